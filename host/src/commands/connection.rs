//! Connection to the board of a rig file, and what to do about a board that stands in a fault.

use std::path::Path;

use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::State;
use plumb_runtime::link::{Link, LinkError, Serial};
use plumb_runtime::rig::Rig;

use super::exit::ExitClass;
use super::{Failure, failed};

/// Connects to the board of `rig` of `file` and configures it.
///
/// # Errors
/// Where the board has stopped by itself: the fault stays until `plumb clear`.
pub(super) fn connect(file: &Path, rig: &Rig, serial: Serial) -> Result<Link<Serial>, Failure> {
    let (wiring, config) = (rig.wiring()?, rig.config()?);
    let mut link = Link::connect(serial)?;
    link.configure(wiring, config).map_err(|error| explained(error, file))?;
    Ok(link)
}

/// Connects to the board of the rig file `file` and looks whether it could be configured. Changes
/// nothing there.
///
/// # Errors
/// Where the board has stopped by itself, as [`connect`].
pub(super) fn check_state(file: &Path, serial: Serial) -> Result<(), Failure> {
    let mut link = Link::connect(serial)?;
    match link.status()?.state {
        State::Fault(fault) => {
            Err(explained(LinkError::Faulted { port: link.port(), fault }, file))
        }
        _ => Ok(()),
    }
}

/// Returns the failure of a command for the rig file `file`. Of a fault that was there before, it
/// says how to clear it.
pub(super) fn explained(error: impl ExitClass + 'static, file: &Path) -> Failure {
    let is_fault = ErrorChain(&error)
        .errors()
        .any(|error| matches!(error.downcast_ref::<LinkError>(), Some(LinkError::Faulted { .. })));
    if !is_fault {
        return error.into();
    }
    let (error, file) = (ErrorChain(&error), file.display());
    failed(format!("{error}. Run `plumb clear {file}`, then this command again"))
}
