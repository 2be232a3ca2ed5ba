//! Connection to the board of a rig file, and what to do about a board that stands in a fault.

use std::path::Path;

use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::State;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::{Link, LinkError, Serial};
use plumb_runtime::rig::Rig;

use super::exit::ExitClass;
use super::rig_args::PortArgs;
use super::{Failure, failed};

/// Opens the port, connects to the board of `rig` of `file`, and configures it.
///
/// # Errors
/// Where the board has stopped by itself: the fault stays until `plumb clear`.
pub(super) fn connect(file: &Path, rig: &Rig, port: &PortArgs) -> Result<Link<Serial>, Failure> {
    configured(file, rig, port, port.open(rig)?)
}

/// Connects to the board at the open port `serial`, and configures it, as [`connect`].
///
/// # Errors
/// As [`connect`].
pub(super) fn configured(
    file: &Path,
    rig: &Rig,
    port: &PortArgs,
    serial: Serial,
) -> Result<Link<Serial>, Failure> {
    let (wiring, config) = (rig.wiring()?, rig.config()?);
    let mut link = Link::connect(serial)?;
    link.configure(wiring, config).map_err(|error| explained(error, file, port))?;
    Ok(link)
}

/// Connects to the board of `rig` of `file` and looks whether it could be configured. Changes
/// nothing there.
///
/// # Errors
/// Where the board has stopped by itself, as [`connect`].
pub(super) fn check_state(file: &Path, rig: &Rig, port: &PortArgs) -> Result<(), Failure> {
    let mut link = Link::connect(port.open(rig)?)?;
    match link.status()?.state {
        State::Fault(fault) => {
            Err(explained(LinkError::Faulted { port: link.port(), fault }, file, port))
        }
        _ => Ok(()),
    }
}

/// Returns how to get a simulated rig for the emulated board at the port; `None` at a port that is
/// no pseudo-terminal, or where `rig` of `file` has one.
pub(super) fn without_simulation(file: &Path, rig: &Rig, port: &PortArgs) -> Option<String> {
    let port = port.pseudo_terminal(rig).filter(|_| rig.simulation.is_none())?;
    Some(format!(
        "The board seems to be emulated, but {} has no [simulation]: its pictures come from a real \
         camera or from another program. A simulated rig for this board: `plumb init trial \
         --simulated`, then `plumb run trial/rig.toml --port {port}`",
        file.display()
    ))
}

/// Returns the failure of a command for the rig file `file` and these options. Of a fault that was
/// there before, it says how to clear it, with the whole commands.
pub(super) fn explained(error: impl ExitClass + 'static, file: &Path, port: &PortArgs) -> Failure {
    let fault = ErrorChain(&error).errors().find_map(|error| match error.downcast_ref() {
        Some(LinkError::Faulted { fault, .. }) => Some(*fault),
        _ => None,
    });
    let Some(fault) = fault else { return error.into() };
    let (error, file) = (ErrorChain(&error), file.display());
    let home = match BoardFault::from(fault).asks_for_home() {
        true => format!(
            "hang the ball (`plumb jog {file}{port}` winds the cables), `plumb home {file}{port}` \
             with it at a known place, then "
        ),
        false => String::new(),
    };
    failed(format!("{error}. Run `plumb clear {file}{port}`, then {home}this command again"))
}
