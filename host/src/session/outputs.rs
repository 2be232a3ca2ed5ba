//! Outputs of a run: files, viewers, messages and progress on the terminal.

mod messages;
mod recording;
mod run_folder;
pub(crate) mod run_progress;

use plumb_frame::source::BoxedError;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::run::Summary;

use crate::cli::exit::Failure;
use run_progress::Progress;

pub(crate) use messages::Messages;
pub(crate) use run_folder::RunFolder;

/// Output of a run that is closed at its end.
pub(crate) trait Output: Observer {
    /// Writes what is left, and closes the files. Prints nothing: the terminal may be stopped
    /// (Ctrl-S), and the files do not wait for it.
    fn close(self: Box<Self>) -> Closed;
}

/// Result of an output that is closed.
pub(crate) struct Closed {
    /// Line for people, behind the result of the run.
    pub(crate) message: Option<String>,
    pub(crate) result: Result<(), Failure>,
}

/// Outputs of a run.
pub(crate) struct Outputs {
    pub(crate) list: Vec<Box<dyn Output>>,
    pub(crate) progress: Progress,
    pub(crate) messages: Messages,
}

impl Outputs {
    /// Returns the outputs of a run, which goes on after a fault where `is_operated`.
    pub(crate) fn new(list: Vec<Box<dyn Output>>, progress: Progress, is_operated: bool) -> Self {
        Self { list, progress, messages: Messages::new(is_operated) }
    }
}

impl Observer for Outputs {
    fn frame(&mut self, record: &FrameRecord) {
        self.list.iter_mut().for_each(|output| output.frame(record));
        self.progress.frame(record);
        self.messages.frame(record);
    }

    fn event(&mut self, record: &EventRecord) {
        self.list.iter_mut().for_each(|output| output.event(record));
        self.progress.event(record);
        self.messages.event(record);
    }

    fn end(&mut self, summary: &Summary) {
        self.list.iter_mut().for_each(|output| output.end(summary));
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.list.iter_mut().find_map(|output| output.failure())
    }

    fn dropped(&self) -> u64 {
        self.list.iter().map(|output| output.dropped()).sum()
    }
}
