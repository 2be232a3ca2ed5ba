//! A recording, played in the time in which it was made.

use std::thread;
use std::time::{Duration, Instant};

use super::{Live, Source, SourceError};
use crate::frame::RgbdFrame;

/// A source whose frames come when they were taken, counted from the first: a recording where a camera is wanted.
#[derive(Debug)]
pub struct Paced<S> {
    source: S,
    /// When the first frame came, and its time stamp, seconds.
    begin: Option<(Instant, f64)>,
}

impl<S: Source> Paced<S> {
    /// Plays `source`.
    pub fn new(source: S) -> Self {
        Self { source, begin: None }
    }
}

impl<S: Source> Source for Paced<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(frame) = self.source.next_frame()? else { return Ok(None) };
        let (begin, first) = *self.begin.get_or_insert_with(|| (Instant::now(), frame.time()));
        if let Ok(span) = Duration::try_from_secs_f64(frame.time() - first) {
            thread::sleep((begin + span).saturating_duration_since(Instant::now()));
        }
        Ok(Some(frame))
    }
}

impl<S: Source> Live for Paced<S> {
    /// The first frame's time stamp and what passed since; 0 before it.
    fn now(&self) -> f64 {
        self.begin.map_or(0.0, |(begin, first)| first + begin.elapsed().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use opencv::core::{CV_8UC3, CV_16UC1, Mat, Scalar};

    use super::*;
    use crate::camera::Intrinsics;

    struct Two(Vec<f64>);

    impl Source for Two {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            let mat = |typ| Mat::new_rows_cols_with_default(2, 2, typ, Scalar::all(1.0)).unwrap();
            let intrinsics = Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1000.0 };
            let frame = |time| RgbdFrame::new(time, mat(CV_8UC3), mat(CV_16UC1), intrinsics).unwrap();
            Ok(self.0.pop().map(frame))
        }
    }

    #[test]
    fn no_frame_comes_before_its_time() {
        let mut paced = Paced::new(Two(vec![1305.1, 1305.05, 1305.0]));
        assert_eq!(paced.now(), 0.0);
        for time in [1305.0, 1305.05, 1305.1] {
            assert_eq!(paced.next_frame().unwrap().unwrap().time(), time);
            assert!(paced.now() >= time - 1e-9);
        }
        assert!(paced.next_frame().unwrap().is_none());
    }
}
