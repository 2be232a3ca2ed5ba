//! The run folder: the rows of the run, its summary and figures, and two pictures.

use std::io;
use std::path::PathBuf;

use plumb_cameras::record::Overflow;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::source::BoxedError;
use plumb_log::{RunLog, RunPictures};
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::run::Summary;

use super::{Closed, Output};
use crate::cli::exit::failed;

/// Rows that may wait for the disk: 5 minutes at 30 Hz, some 5 MB.
const CAPACITY: usize = 9000;

/// Output into the run folder.
pub(crate) struct RunFolder {
    log: BoundedObserver<RunLog>,
    pictures: RunPictures,
    folder: PathBuf,
}

impl RunFolder {
    /// Starts to write into the folder of `log`.
    pub(crate) fn start(log: RunLog, overflow: Overflow) -> io::Result<Self> {
        let folder = log.path().to_owned();
        let settings =
            QueueSettings { name: "run log", capacity: CAPACITY, overflow, with_frames: false };
        let log = BoundedObserver::new(log, settings)?;
        Ok(Self { log, pictures: RunPictures::default(), folder })
    }
}

impl Observer for RunFolder {
    fn frame(&mut self, record: &FrameRecord) {
        self.log.frame(record);
        self.pictures.frame(record);
    }

    fn event(&mut self, record: &EventRecord) {
        self.log.event(record);
    }

    fn end(&mut self, summary: &Summary) {
        self.log.end(summary);
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.log.failure()
    }

    fn dropped(&self) -> u64 {
        self.log.dropped()
    }
}

impl Output for RunFolder {
    /// Reports the first file that could not be written. Rows that a slow disk had no time for are
    /// no failure.
    fn close(self: Box<Self>) -> Closed {
        let dropped = self.log.dropped();
        let rows = match self.log.close() {
            Ok(log) => log.unwritten().map(|error| ErrorChain(error).to_string()),
            Err(error) => Some(ErrorChain(&error).to_string()),
        };
        let pictures = self.pictures.write(&self.folder).err();
        let error = rows.or_else(|| pictures.map(|error| ErrorChain(&error).to_string()));
        let lacks = || format!("plumb: the run log lacks {dropped} rows: the disk is slow");
        Closed {
            message: (dropped > 0).then(lacks),
            result: match error {
                Some(error) => Err(failed(format!("the run folder is not complete: {error}"))),
                None => Ok(()),
            },
        }
    }
}
