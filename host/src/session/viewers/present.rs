//! The outputs for viewers: an MCAP file, a live server, or both, behind a queue.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::ParseBoolError;

use plumb_cameras::record::Overflow;
use plumb_cameras::recording::has_mcap_ending;
use plumb_config::error_chain::ErrorChain;
use plumb_foxglove::{FoxgloveOutput, FoxgloveSettings};
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::listening::address_to_open;
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use super::ViewerOptions;
use crate::cli::exit::{Failure, failed};
use crate::session::outputs::{Closed, Output};

/// Frames that may wait for the disk: a second at 30 Hz, some 45 MB.
const CAPACITY: usize = 30;

/// Reads the path of the MCAP file. Its name must be that of one: who reads it knows it by that.
pub(crate) fn file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match has_mcap_ending(&path) {
        true => Ok(path),
        false => Err("must end in .mcap: the file is an MCAP".to_owned()),
    }
}

/// Reads the option `--foxglove`.
pub(crate) fn flag(text: &str) -> Result<bool, ParseBoolError> {
    text.parse()
}

impl ViewerOptions {
    /// Starts the outputs of a run that the options ask for; `None` where they ask for none. In
    /// virtual time nothing is late, and `overflow` is to block.
    ///
    /// # Errors
    /// Where the file exists or cannot be created, or the address cannot be used.
    pub(crate) fn start(
        &self,
        rig: &Rig,
        camera: &Camera,
        overflow: Overflow,
    ) -> Result<Option<Box<dyn Output>>, Failure> {
        let address = self.foxglove.then_some(self.foxglove_address);
        let settings = FoxgloveSettings { mcap: self.mcap.clone(), server: address };
        if settings == FoxgloveSettings::default() {
            return Ok(None);
        }
        let output = FoxgloveOutput::start(&settings, rig, camera)?;
        if let (Some(address), Some(port)) = (address, output.port()) {
            let open = address_to_open(SocketAddr::new(address.ip(), port));
            let others = match address.ip().is_loopback() {
                true => " (this computer only; --foxglove-address 0.0.0.0 for others too)",
                false => "",
            };
            note!("live server for viewers: ws://{open}{others}");
        }
        let queue = QueueSettings {
            name: "output for viewers",
            capacity: CAPACITY,
            overflow,
            with_frames: true,
        };
        Ok(Some(Box::new(BoundedObserver::new(output, queue)?)))
    }
}

impl Output for BoundedObserver<FoxgloveOutput> {
    /// Completes the MCAP file and ends the server.
    fn close(self: Box<Self>) -> Closed {
        let dropped = self.dropped();
        let lack = || format!("plumb: the viewers lack {dropped} frames: the disk is slow");
        let result = (*self).close().map(drop).map_err(|error| {
            failed(format!("the MCAP file is not complete: {}", ErrorChain(&error)))
        });
        Closed { message: (dropped > 0).then(lack), result }
    }
}
