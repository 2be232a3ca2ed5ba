//! The outputs for viewers: an MCAP file, a live server, or both, behind a queue.

use std::net::SocketAddr;
use std::path::PathBuf;

use plumb_cameras::record::Overflow;
use plumb_config::error_chain::ErrorChain;
use plumb_foxglove::{FoxgloveOutput, FoxgloveSettings};
use plumb_frame::source::BoxedError;
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::Summary;
use plumb_vision::camera::Camera;

use super::super::address::with_port;
use super::super::print::{note, tell};
use super::super::{Failure, failed};
use super::{DEFAULT_ADDRESS, ViewerOptions};

/// Frames that may wait for the disk: a second at 30 Hz, some 45 MB.
const CAPACITY: usize = 30;

/// Reads the path of the MCAP file.
pub(super) fn file(text: &str) -> Result<PathBuf, String> {
    Ok(text.into())
}

/// Reads an address with a port, or one without, which gets the viewers' usual port.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    with_port(text, DEFAULT_ADDRESS)
}

/// Observer for viewers; without effect where no option asks for one.
pub(in super::super) struct Viewers(Option<BoundedObserver<FoxgloveOutput>>);

impl ViewerOptions {
    /// Starts the outputs of a run that the options ask for. In virtual time nothing is late, and
    /// `overflow` is to block.
    ///
    /// # Errors
    /// Where the file exists or cannot be created, or the address cannot be used.
    pub(in super::super) fn start(
        &self,
        rig: &Rig,
        camera: &Camera,
        overflow: Overflow,
    ) -> Result<Viewers, Failure> {
        let settings = FoxgloveSettings { mcap: self.mcap.clone(), server: self.foxglove };
        if settings == FoxgloveSettings::default() {
            return Ok(Viewers(None));
        }
        let output = FoxgloveOutput::start(&settings, rig, camera)?;
        if let (Some(address), Some(port)) = (self.foxglove, output.port()) {
            note!("live server for viewers: ws://{}", SocketAddr::new(address.ip(), port));
        }
        let queue = QueueSettings {
            name: "output for viewers",
            capacity: CAPACITY,
            overflow,
            with_frames: true,
        };
        Ok(Viewers(Some(BoundedObserver::new(output, queue)?)))
    }
}

impl Viewers {
    /// Completes the MCAP file and ends the server.
    ///
    /// # Errors
    /// Where the file could not be written.
    pub(in super::super) fn close(self) -> Result<(), Failure> {
        let Some(queue) = self.0 else { return Ok(()) };
        let dropped = queue.dropped();
        if dropped > 0 {
            tell!("plumb: the viewers lack {dropped} frames: the disk is slow");
        }
        match queue.close() {
            Ok(_) => Ok(()),
            Err(error) => {
                Err(failed(format!("the MCAP file is not complete: {}", ErrorChain(&error))))
            }
        }
    }
}

impl Observer for Viewers {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(queue) = &mut self.0 {
            queue.frame(record);
        }
    }

    fn event(&mut self, event: &EventRecord) {
        if let Some(queue) = &mut self.0 {
            queue.event(event);
        }
    }

    fn end(&mut self, summary: &Summary) {
        if let Some(queue) = &mut self.0 {
            queue.end(summary);
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.0.as_mut()?.failure()
    }

    fn dropped(&self) -> u64 {
        self.0.as_ref().map_or(0, Observer::dropped)
    }
}
