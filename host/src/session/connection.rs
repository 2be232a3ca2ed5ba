//! Connection to the board of a rig file, and what to do about a board that stands in a fault.

use std::path::Path;

use plumb_protocol::message::{Fault, State};
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::{Link, LinkError, Serial};
use plumb_runtime::rig::Rig;

use crate::cli::exit::Failure;
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::rig_option;

/// Opens the port, connects to the board of `rig` of `file`, and configures it; for `plumb home` if
/// `is_home`.
///
/// # Errors
/// Where the board has stopped by itself: the fault stays until `plumb clear`.
pub(crate) fn connect(
    file: &Path,
    rig: &Rig,
    port: &PortArgs,
    is_home: bool,
) -> Result<Link<Serial>, Failure> {
    configured(file, rig, port, port.open(rig)?, is_home)
}

/// Connects to the board at the open port `serial`, and configures it, as [`connect`].
///
/// # Errors
/// As [`connect`].
pub(crate) fn configured(
    file: &Path,
    rig: &Rig,
    port: &PortArgs,
    serial: Serial,
    is_home: bool,
) -> Result<Link<Serial>, Failure> {
    let (wiring, config) = (rig.wiring()?, rig.config()?);
    let mut link = Link::connect(serial)?;
    link.configure(wiring, config).map_err(|error| explained(error, file, port, is_home))?;
    Ok(link)
}

/// Connects to the board of `rig` of `file` and looks whether it could be configured. Changes
/// nothing there.
///
/// # Errors
/// Where the board has stopped by itself, as [`connect`].
pub(crate) fn check_state(file: &Path, rig: &Rig, port: &PortArgs) -> Result<(), Failure> {
    let mut link = Link::connect(port.open(rig)?)?;
    match link.status()?.state {
        State::Fault(fault) => {
            Err(explained(LinkError::Faulted { port: link.port(), fault }, file, port, false))
        }
        _ => Ok(()),
    }
}

/// Returns how to get a simulated rig for the emulated board at the port; `None` at a port that is
/// no pseudo-terminal, or where `rig` of `file` has one.
pub(crate) fn without_simulation(file: &Path, rig: &Rig, port: &PortArgs) -> Option<String> {
    let port = port.pseudo_terminal(rig).filter(|_| rig.simulation.is_none())?;
    Some(format!(
        "The board seems to be emulated, but {} has no [simulation]: its pictures come from a real \
         camera or from another program. A simulated rig for this board: `plumb init trial \
         --simulated`, then `plumb run --rig trial/rig.toml --port {port}`",
        file.display()
    ))
}

/// Returns the failure of a command, `plumb home` if `is_home`, for the rig file `file` and these
/// options. Of a fault it says how to clear it with the whole command, and of one that was there
/// before also what to do then.
pub(crate) fn explained(error: LinkError, file: &Path, port: &PortArgs, is_home: bool) -> Failure {
    let advice = match error {
        LinkError::Faulted { fault, .. } => steps_after(fault, file, port, is_home),
        LinkError::Fault(_) => format!("`plumb clear{}{port}` clears it", rig_option(file)),
        _ => String::new(),
    };
    Failure::from(error).with_advice(advice)
}

/// Returns what to do after `fault`, which was there before a command, until it succeeds: `plumb
/// home` if `is_home`, else another one.
fn steps_after(fault: Fault, file: &Path, port: &PortArgs, is_home: bool) -> String {
    let rig = rig_option(file);
    let clear = format!("Run `plumb clear{rig}{port}`, then");
    if !BoardFault::from(fault).asks_for_home() {
        return format!("{clear} this command again");
    }
    let hang = format!("hang the ball (`plumb jog{rig}{port}` winds the cables)");
    let place = "with it at a known place";
    match is_home {
        true => format!("{clear} {hang}, then this command {place}"),
        false => {
            format!("{clear} {hang}, `plumb home{rig}{port}` {place}, then this command again")
        }
    }
}
