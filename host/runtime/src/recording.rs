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
}
