//! The recording of a run's pictures.

use plumb_runtime::observer::FrameRecorder;

use super::{Closed, Output};
use crate::cli::print::is_quiet;

impl Output for FrameRecorder {
    fn close(self: Box<Self>) -> Closed {
        let recording = match self.finish() {
            Ok(recording) => recording,
            Err(error) => return Closed { message: None, result: Err(error.into()) },
        };
        let dropped = match recording.dropped {
            0 => String::new(),
            n => format!(", {n} left out: they came faster than they could be written"),
        };
        let (frames, folder) = (recording.frames, recording.folder.display());
        let message = || format!("recorded: {frames} frames in {folder}{dropped}");
        Closed { message: (!is_quiet()).then(message), result: Ok(()) }
    }
}
