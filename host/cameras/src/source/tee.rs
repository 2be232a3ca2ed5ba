//! Camera source whose frames are also recorded.

use plumb_vision::frame::RgbdFrame;

use super::camera_source::CameraSource;
use super::error::SourceError;
use crate::record::{RecordError, Recorder, Recording};

/// Camera source that passes on the frames of another one and gives each to a recorder.
///
/// A failure of the recording never delays or loses a frame. [`finish`](Self::finish) returns it.
#[derive(Debug)]
pub struct Tee<S> {
    source: S,
    recorder: Option<Recorder>,
}

impl<S> Tee<S> {
    /// Records the frames of `source`; without a recorder they are passed on only.
    pub fn new(source: S, recorder: Option<Recorder>) -> Self {
        Self { source, recorder }
    }

    /// Returns the source of the frames.
    pub fn source(&self) -> &S {
        &self.source
    }

    /// Ends the recording. Returns the source and a summary of the recording.
    ///
    /// # Errors
    /// Where the recording could not be written to its end.
    pub fn finish(self) -> (S, Result<Option<Recording>, RecordError>) {
        (self.source, self.recorder.map(Recorder::finish).transpose())
    }
}

impl<S: CameraSource> CameraSource for Tee<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let frame = self.source.next_frame()?;
        if let (Some(frame), Some(recorder)) = (&frame, &mut self.recorder) {
            recorder.add(frame);
        }
        Ok(frame)
    }

    fn now(&self) -> f64 {
        self.source.now()
    }

    fn is_live(&self) -> bool {
        self.source.is_live()
    }
}
