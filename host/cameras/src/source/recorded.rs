//! A source whose frames are recorded as they are taken.

use plumb_vision::frame::RgbdFrame;

use super::{Live, Source, SourceError};
use crate::record::{RecordError, Recorder, Recording};

/// `source`, with every frame that it gives also given to a recorder, where there is one. What goes
/// wrong with the recording is told at its end, and never keeps a frame back.
#[derive(Debug)]
pub struct Recorded<S> {
    source: S,
    recorder: Option<Recorder>,
}

impl<S> Recorded<S> {
    /// Records what `source` gives.
    pub fn new(source: S, recorder: Option<Recorder>) -> Self {
        Self { source, recorder }
    }

    /// The source.
    pub fn source(&self) -> &S {
        &self.source
    }

    /// Ends the recording; the source, and what was recorded.
    ///
    /// # Errors
    /// Where it could not be written to its end.
    pub fn finish(self) -> (S, Result<Option<Recording>, RecordError>) {
        (self.source, self.recorder.map(Recorder::finish).transpose())
    }
}

impl<S: Source> Source for Recorded<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let frame = self.source.next_frame()?;
        if let (Some(frame), Some(recorder)) = (&frame, &mut self.recorder) {
            recorder.add(frame);
        }
        Ok(frame)
    }
}

impl<S: Live> Live for Recorded<S> {
    fn now(&self) -> f64 {
        self.source.now()
    }
}
