//! Recording of a run's frames.

use plumb_cameras::record::{RecordError, Recorder, Recording};

use crate::observer::{FrameRecord, Observer};

/// Observer that records the frames. The recorder has a queue and a thread of its own.
#[derive(Debug)]
pub struct FrameRecorder(Recorder);

impl FrameRecorder {
    /// Records to `recorder`.
    pub fn new(recorder: Recorder) -> Self {
        Self(recorder)
    }

    /// Ends the recording. Returns what was recorded.
    ///
    /// # Errors
    /// Where the recording could not be written to its end.
    pub fn finish(self) -> Result<Recording, RecordError> {
        self.0.finish()
    }
}

impl Observer for FrameRecorder {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(frame) = &record.frame {
            self.0.add(frame);
        }
    }

    fn dropped(&self) -> u64 {
        self.0.dropped()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use nalgebra::Point3;
    use plumb_cameras::camera_file;
    use plumb_cameras::record::{Overflow, RecordFolder};
    use plumb_frame::frame::RgbdFrame;
    use plumb_frame::image::Image;

    use super::*;

    fn record() -> FrameRecord {
        let intrinsics = camera_file::paper().unwrap().intrinsics;
        let (colour, depth) = (Image::filled(4, 4, [0; 3]), Image::filled(4, 4, 0));
        let frame = RgbdFrame::new(0.0, colour, depth, intrinsics).unwrap();
        let (observation, board, state) = (None, None, None);
        let (number, time, target) = (0, 0.0, Point3::origin());
        FrameRecord {
            number,
            time,
            frame: Some(Arc::new(frame)),
            observation,
            target,
            board,
            fault_cause: None,
            state,
            filtered_error: None,
            ground_truth: None,
            path: None,
        }
    }

    #[test]
    fn frames_that_cannot_be_written_count_as_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record");
        let record = record();
        let intrinsics = record.frame.as_ref().unwrap().intrinsics();
        let recorder = RecordFolder::create(&path)
            .unwrap()
            .begin(camera_file::PAPER, intrinsics, Overflow::Block)
            .unwrap();
        fs::remove_dir_all(path.join("depth")).unwrap();
        let mut recorder = FrameRecorder::new(recorder);
        let added = (1..1000).find(|_| {
            recorder.frame(&record);
            recorder.dropped() > 0
        });
        assert!(added.is_some_and(|added| added > 1), "{added:?}");
        assert!(recorder.finish().is_err());
    }
}
