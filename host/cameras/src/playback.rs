//! Playback of a recording at the speed at which it was recorded.

use std::thread;
use std::time::{Duration, Instant};

use plumb_frame::clock::LiveClock;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use thiserror::Error;

/// Longest gap between two frames. It is the time after which a live camera without pictures counts
/// as silent ([`plumb_openni::Timeouts`]), and the longest delay of an interruption.
pub const LONGEST_GAP: Duration = Duration::from_secs(2);

/// Camera source that plays a recording in the place of a camera.
///
/// Its clock is 0 until the first frame is delivered, and runs from there. The frames are stamped
/// on this clock, whatever the recording's time stamps are. A lost frame with a known time stamp
/// takes its time too.
///
/// A caller that is slower than the recording gets every frame, later and later. A
/// [`Capture`](crate::capture::Capture) leaves the overdue ones out, as of a camera.
///
/// A frame whose time stamp is before the previous one is lost ([`PlaybackError::Backwards`]). A
/// gap above [`LONGEST_GAP`] ends the recording ([`PlaybackError::Gap`]).
#[derive(Debug)]
pub struct Playback<S> {
    source: S,
    clock: LiveClock,
    progress: Option<ReplayProgress>,
}

/// Time stamp that a recording cannot be played at.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum PlaybackError {
    /// The recording has no frame for longer than [`LONGEST_GAP`], and ends there.
    #[error(
        "the frame at {time:.6} s was taken {gap:.3} s after the one before; a recording that is \
         played as a camera may have gaps of at most {} s",
        LONGEST_GAP.as_secs()
    )]
    Gap {
        /// Time stamp of the frame after the gap, seconds on the recording's clock.
        time: f64,
        /// Time since the frame before it, seconds.
        gap: f64,
    },
    /// The time stamp is before that of the previous frame. The frame is lost.
    #[error(
        "the frame at {time:.6} s is out of order: the one before it was taken at {before:.6} s"
    )]
    Backwards {
        /// Time stamp of the lost frame, seconds on the recording's clock.
        time: f64,
        /// Time stamp of the frame before it, seconds on the recording's clock.
        before: f64,
    },
}

impl From<PlaybackError> for SourceError {
    fn from(error: PlaybackError) -> Self {
        match error {
            PlaybackError::Gap { .. } => Self::over(error),
            PlaybackError::Backwards { .. } => Self::new(error),
        }
    }
}

/// Time stamps of the frames so far, seconds on the recording's clock.
#[derive(Debug, Clone, Copy)]
struct ReplayProgress {
    first: f64,
    last: f64,
}

impl<S: CameraSource> Playback<S> {
    /// Plays the recording `source`.
    pub fn new(source: S) -> Self {
        Self { source, clock: LiveClock::default(), progress: None }
    }

    /// Waits until the frame with the time stamp `stamp` (seconds on the recording's clock) is due.
    /// Returns its time stamp on this clock.
    fn wait_for(&mut self, stamp: f64) -> Result<f64, PlaybackError> {
        let start = self.clock.start();
        let progress = self.progress.get_or_insert(ReplayProgress { first: stamp, last: stamp });
        let gap = stamp - progress.last;
        if gap < 0.0 {
            return Err(PlaybackError::Backwards { time: stamp, before: progress.last });
        }
        if gap.is_nan() || gap > LONGEST_GAP.as_secs_f64() {
            return Err(PlaybackError::Gap { time: stamp, gap });
        }
        progress.last = stamp;
        let time = stamp - progress.first;
        let due = Duration::try_from_secs_f64(time).ok().and_then(|span| start.checked_add(span));
        // Gaps are limited, so that only a recording of centuries has a frame that is due beyond
        // the clock's range.
        let Some(due) = due else { return Err(PlaybackError::Gap { time: stamp, gap }) };
        thread::sleep(due.saturating_duration_since(Instant::now()).min(LONGEST_GAP));
        Ok(time)
    }
}

impl<S: CameraSource> CameraSource for Playback<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.source.next_frame() {
            Ok(None) => Ok(None),
            Ok(Some(frame)) => {
                let time = self.wait_for(frame.time())?;
                let frame = frame.with_time(time).map_err(InvalidFrame::of("the recording"))?;
                Ok(Some(frame))
            }
            Err(error) => match error.stamp() {
                Some(stamp) => Err(error.with_stamp(self.wait_for(stamp)?)),
                None => Err(error),
            },
        }
    }

    /// Returns the seconds since the first frame, 0 before it.
    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use plumb_frame::camera::Intrinsics;
    use plumb_frame::image::Image;

    use plumb_config::error_chain::ErrorChain;

    use super::*;

    /// Frames with these time stamps, or lost ones.
    struct Stamps(VecDeque<Result<f64, f64>>);

    impl CameraSource for Stamps {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            let intrinsics = Intrinsics {
                fx: 1.0,
                fy: 1.0,
                cx: 0.5,
                cy: 0.5,
                depth_scale: 1000.0,
                distortion: None,
            };
            let frame = |time| {
                let (colour, depth) = (Image::filled(2, 2, [1; 3]), Image::filled(2, 2, 1));
                RgbdFrame::new(time, colour, depth, intrinsics).unwrap()
            };
            let lost = |time| SourceError::new("lost.png is damaged").with_stamp(time);
            self.0.pop_front().map(|stamp| stamp.map(frame).map_err(lost)).transpose()
        }

        fn now(&self) -> f64 {
            0.0
        }
    }

    fn playback(stamps: impl IntoIterator<Item = Result<f64, f64>>) -> Playback<Stamps> {
        Playback::new(Stamps(stamps.into_iter().collect()))
    }

    /// Checks that the next frame is stamped with `time`, and that the clock has come there from
    /// `before`.
    fn expect(playback: &mut Playback<Stamps>, before: f64, time: f64) {
        assert!(playback.now() >= before);
        let frame = playback.next_frame().unwrap().unwrap();
        assert!((frame.time() - time).abs() < 1e-6, "{} for {time}", frame.time());
        assert!(playback.now() >= frame.time() - 1e-9, "{} before {time}", playback.now());
    }

    #[test]
    fn frames_and_clock_begin_at_0_whatever_the_recordings_clock() {
        for first in [0.0, 1305.0, 1_305_031_102.175_304, -7.0] {
            let mut playback = playback([0.0, 0.05, 0.05, 0.1].map(|span| Ok(first + span)));
            assert_eq!(playback.now(), 0.0);
            for (before, time) in [(0.0, 0.0), (0.0, 0.05), (0.05, 0.05), (0.05, 0.1)] {
                expect(&mut playback, before, time);
            }
            assert!(playback.next_frame().unwrap().is_none());
            assert!(playback.now() < 1e6);
        }
    }

    #[test]
    fn a_lost_frame_takes_its_time_and_is_told_on_the_same_clock() {
        let mut playback = playback([Err(1e9), Ok(1e9 + 0.03125), Err(1e9 + 0.0625)]);
        assert_eq!(playback.next_frame().unwrap_err().stamp(), Some(0.0));
        expect(&mut playback, 0.0, 0.03125);
        assert_eq!(playback.next_frame().unwrap_err().stamp(), Some(0.0625));
        assert!(playback.now() >= 0.0625);
    }

    #[test]
    fn a_gap_ends_the_recording_at_once() {
        for stamp in [5000.0, 1e19, f64::MAX] {
            let mut playback = playback([Ok(0.0), Ok(stamp)]);
            expect(&mut playback, 0.0, 0.0);
            let error = playback.next_frame().unwrap_err();
            let message = ErrorChain(&error).to_string();
            assert!(error.is_over() && message.contains("gaps of at most 2 s"), "{message}");
        }
        let mut playback = playback([Ok(-f64::MAX), Ok(f64::MAX)]);
        expect(&mut playback, 0.0, 0.0);
        assert!(playback.next_frame().unwrap_err().is_over());
    }

    #[test]
    fn a_frame_whose_time_stamp_falls_is_lost_and_the_others_come() {
        let mut playback = playback([Ok(100.0), Ok(99.0), Err(-1e19), Ok(100.01)]);
        expect(&mut playback, 0.0, 0.0);
        for _ in 0..2 {
            let error = playback.next_frame().unwrap_err();
            let message = ErrorChain(&error).to_string();
            assert!(!error.is_over() && message.contains("out of order"), "{message}");
        }
        expect(&mut playback, 0.0, 0.01);
    }
}
