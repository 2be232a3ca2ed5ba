//! Connection to the board of a rig file, and what to do about a board that stands in a fault.

use std::path::Path;

use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::{Fault, State};
use plumb_runtime::board_fault::{BoardFault, after_fault};
use plumb_runtime::link::{Link, LinkError, Serial};
use plumb_runtime::rig::Rig;

use super::exit::{BAD_INPUT, ExitClass};
use super::rig_args::PortArgs;
use super::rig_path::rig_option;
use super::{Failure, bad_input, failed};

/// Opens the port, connects to the board of `rig` of `file`, and configures it.
///
/// # Errors
/// Where the board has stopped by itself: the fault stays until `plumb clear`.
pub(super) fn connect(file: &Path, rig: &Rig, port: &PortArgs) -> Result<Link<Serial>, Failure> {
    configured(file, rig, port, port.open(rig)?)
}

/// Opens the port, connects to the board and configures it, as [`connect`], for `plumb home`.
///
/// # Errors
/// As [`connect`].
pub(super) fn connect_for_home(
    file: &Path,
    rig: &Rig,
    port: &PortArgs,
) -> Result<Link<Serial>, Failure> {
    configured_or(rig, port.open(rig)?, |error| explained_for_home(error, file, port))
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
    configured_or(rig, serial, |error| explained(error, file, port))
}

/// Connects to the board at the open port `serial`, and configures it. The failure of a
/// configuration is that of `explain`.
fn configured_or(
    rig: &Rig,
    serial: Serial,
    explain: impl FnOnce(LinkError) -> Failure,
) -> Result<Link<Serial>, Failure> {
    let (wiring, config) = (rig.wiring()?, rig.config()?);
    let mut link = Link::connect(serial)?;
    link.configure(wiring, config).map_err(explain)?;
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
         --simulated`, then `plumb run --rig trial/rig.toml --port {port}`",
        file.display()
    ))
}

/// Returns the failure of a command for the rig file `file` and these options. Of a fault it says
/// how to clear it with the whole command, and of one that was there before also what to do then.
pub(super) fn explained(error: impl ExitClass + 'static, file: &Path, port: &PortArgs) -> Failure {
    // The error of the link names the port: the words of those around it would repeat that.
    let of_link = ErrorChain(&error).errors().find_map(|error| error.downcast_ref());
    match of_link {
        Some(faulted @ LinkError::Faulted { fault, .. }) => {
            let steps = steps_after(*fault, file, port, false);
            failed(format!("{faulted}. {steps}"))
        }
        Some(stopped @ LinkError::Fault(fault)) => {
            let (advice, rig) = (after_fault(*fault), rig_option(file));
            failed(format!("{stopped}. {advice} `plumb clear{rig}{port}` clears it"))
        }
        Some(of_link) => in_short(of_link, &error),
        None => error.into(),
    }
}

/// Returns the failure of the error of the link, which is in the chain of `error`, with the exit
/// code and the advice of that.
fn in_short(of_link: &LinkError, error: &impl ExitClass) -> Failure {
    let message = ErrorChain(of_link);
    let failure = if error.exit_code() == BAD_INPUT { bad_input(message) } else { failed(message) };
    match error.advice() {
        Some(advice) => failure.with_advice(advice),
        None => failure,
    }
}

/// Returns the failure of `plumb home` for the rig file `file` and these options, as [`explained`].
fn explained_for_home(error: LinkError, file: &Path, port: &PortArgs) -> Failure {
    match error {
        LinkError::Faulted { fault, .. } => {
            failed(format!("{error}. {}", steps_after(fault, file, port, true)))
        }
        error => explained(error, file, port),
    }
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
