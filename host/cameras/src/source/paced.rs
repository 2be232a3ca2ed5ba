//! A recording, played in the time in which it was made.

use std::thread;
use std::time::{Duration, Instant};

use plumb_vision::frame::RgbdFrame;

use super::{Live, Source, SourceError};

/// Longest time without a picture. A live camera that is silent for so long counts as gone too
/// ([`plumb_openni::Deadlines`]), and an interrupted run goes on for so long at most.
pub const LONGEST_GAP: Duration = Duration::from_secs(2);

/// A source whose frames come when they were taken: a recording where a camera is wanted.
///
/// Its clock stands at 0 until the first frame comes, and runs on from there. Frames are stamped on
/// this clock, whatever the recording's time stamps begin with. Frames that are lost, but whose
/// time is known, take their time too.
///
/// The recording's time stamps may not fall, else the frame is lost ([`SourceError::Backwards`]),
/// and may not leave a gap above [`LONGEST_GAP`], else the recording ends there
/// ([`SourceError::Gap`]).
#[derive(Debug)]
pub struct Paced<S> {
    source: S,
    begun: Option<Begun>,
}

/// Clock of a recording whose first frame has come.
#[derive(Debug, Clone, Copy)]
struct Begun {
    /// When the first frame came.
    at: Instant,
    /// Time stamp of the first frame, seconds on the recording's clock.
    first: f64,
    /// Time stamp of the last frame, likewise.
    last: f64,
}

impl<S: Source> Paced<S> {
    /// Plays `source`.
    pub fn new(source: S) -> Self {
        Self { source, begun: None }
    }

    /// Waits until it is time for the frame with the time stamp `stamp` (seconds on the recording's
    /// clock). Returns its time on this clock.
    fn wait_for(&mut self, stamp: f64) -> Result<f64, SourceError> {
        let fresh = Begun { at: Instant::now(), first: stamp, last: stamp };
        let begun = self.begun.get_or_insert(fresh);
        let gap = stamp - begun.last;
        if gap < 0.0 {
            return Err(SourceError::Backwards { time: stamp, before: begun.last });
        }
        if gap.is_nan() || gap > LONGEST_GAP.as_secs_f64() {
            return Err(SourceError::Gap { time: stamp, gap });
        }
        begun.last = stamp;
        let time = stamp - begun.first;
        let due =
            Duration::try_from_secs_f64(time).ok().and_then(|span| begun.at.checked_add(span));
        // Gaps are limited, so that only a recording of centuries has a frame that is due beyond
        // the clock's range.
        let Some(due) = due else { return Err(SourceError::Gap { time: stamp, gap }) };
        thread::sleep(due.saturating_duration_since(Instant::now()).min(LONGEST_GAP));
        Ok(time)
    }
}

impl<S: Source> Source for Paced<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.source.next_frame() {
            Ok(None) => Ok(None),
            Ok(Some(frame)) => {
                let time = self.wait_for(frame.time())?;
                let what = |error| SourceError::Frame { what: "the recording".to_owned(), error };
                frame.with_time(time).map(Some).map_err(what)
            }
            Err(SourceError::At { time, error }) => {
                let time = self.wait_for(time)?;
                Err(SourceError::At { time, error })
            }
            Err(error) => Err(error),
        }
    }
}

impl<S: Source> Live for Paced<S> {
    /// Seconds since the first frame; 0 before it.
    fn now(&self) -> f64 {
        self.begun.map_or(0.0, |begun| begun.at.elapsed().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use plumb_vision::camera::Intrinsics;
    use plumb_vision::image::Image;

    use super::*;

    /// Frames with these time stamps, or lost ones.
    struct Stamps(VecDeque<Result<f64, f64>>);

    impl Source for Stamps {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            let intrinsics = Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1000.0 };
            let frame = |time| {
                let (colour, depth) = (Image::filled(2, 2, [1; 3]), Image::filled(2, 2, 1));
                RgbdFrame::new(time, colour, depth, intrinsics).unwrap()
            };
            let lost = |time| SourceError::At {
                time,
                error: SourceError::Decode { path: "lost.png".into() }.into(),
            };
            self.0.pop_front().map(|stamp| stamp.map(frame).map_err(lost)).transpose()
        }
    }

    fn paced(stamps: impl IntoIterator<Item = Result<f64, f64>>) -> Paced<Stamps> {
        Paced::new(Stamps(stamps.into_iter().collect()))
    }

    /// Checks that the next frame is stamped with `time`, and that the clock has come there from
    /// `before`.
    fn expect(paced: &mut Paced<Stamps>, before: f64, time: f64) {
        assert!(paced.now() >= before);
        let frame = paced.next_frame().unwrap().unwrap();
        assert!((frame.time() - time).abs() < 1e-6, "{} for {time}", frame.time());
        assert!(paced.now() >= frame.time() - 1e-9, "{} before {time}", paced.now());
    }

    #[test]
    fn frames_and_clock_begin_at_0_whatever_the_recordings_clock() {
        for first in [0.0, 1305.0, 1_305_031_102.175_304, -7.0] {
            let mut paced = paced([0.0, 0.05, 0.05, 0.1].map(|span| Ok(first + span)));
            assert_eq!(paced.now(), 0.0);
            for (before, time) in [(0.0, 0.0), (0.0, 0.05), (0.05, 0.05), (0.05, 0.1)] {
                expect(&mut paced, before, time);
            }
            assert!(paced.next_frame().unwrap().is_none());
            assert!(paced.now() < 1e6);
        }
    }

    #[test]
    fn a_lost_frame_takes_its_time_and_is_told_on_the_same_clock() {
        let mut paced = paced([Err(1e9), Ok(1e9 + 0.03125), Err(1e9 + 0.0625)]);
        assert_eq!(paced.next_frame().unwrap_err().time(), Some(0.0));
        expect(&mut paced, 0.0, 0.03125);
        assert_eq!(paced.next_frame().unwrap_err().time(), Some(0.0625));
        assert!(paced.now() >= 0.0625);
    }

    #[test]
    fn a_gap_ends_the_recording_at_once() {
        for stamp in [5000.0, 1e19, f64::MAX] {
            let mut paced = paced([Ok(0.0), Ok(stamp)]);
            expect(&mut paced, 0.0, 0.0);
            let error = paced.next_frame().unwrap_err();
            assert!(
                error.is_final() && error.to_string().contains("gaps of at most 2 s"),
                "{error}"
            );
        }
        let mut paced = paced([Ok(-f64::MAX), Ok(f64::MAX)]);
        expect(&mut paced, 0.0, 0.0);
        assert!(paced.next_frame().unwrap_err().is_final());
    }

    #[test]
    fn a_frame_whose_time_stamp_falls_is_lost_and_the_others_come() {
        let mut paced = paced([Ok(100.0), Ok(99.0), Err(-1e19), Ok(100.01)]);
        expect(&mut paced, 0.0, 0.0);
        for _ in 0..2 {
            let error = paced.next_frame().unwrap_err();
            assert!(!error.is_final() && error.to_string().contains("out of order"), "{error}");
        }
        expect(&mut paced, 0.0, 0.01);
    }
}
