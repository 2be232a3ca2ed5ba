//! Connection to the board of a rig file, and what to do about a board that stands in a fault.

use std::path::Path;

use plumb_protocol::message::{Fault, State};
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;

use crate::cli::exit::Failure;
use crate::cli::port::Port;
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::rig_option;

/// The board of a rig file at the port of the options.
#[derive(Clone, Copy)]
pub(crate) struct RigBoard<'a> {
    /// Rig file.
    pub(crate) file: &'a Path,
    pub(crate) rig: &'a Rig,
    pub(crate) port: &'a PortArgs,
}

impl RigBoard<'_> {
    /// Opens the port, connects to the board, and configures it; for `plumb home` if `is_home`.
    ///
    /// # Errors
    /// Where the board has stopped by itself: the fault stays until `plumb clear`.
    pub(crate) fn connect(self, is_home: bool) -> Result<Link<Port>, Failure> {
        self.configured(self.port.open(self.rig)?, is_home)
    }

    /// Connects to the board at the open port `port`, and configures it, as
    /// [`connect`](Self::connect).
    pub(crate) fn configured(self, port: Port, is_home: bool) -> Result<Link<Port>, Failure> {
        let (wiring, config) = (self.rig.wiring()?, self.rig.config()?);
        let mut link = Link::connect(port)?;
        link.configure(wiring, config).map_err(|error| self.explained(error, is_home))?;
        Ok(link)
    }

    /// Connects to the board and looks whether it could be configured. Changes nothing there.
    ///
    /// # Errors
    /// Where the board has stopped by itself, as [`connect`](Self::connect).
    pub(crate) fn check_state(self) -> Result<(), Failure> {
        let mut link = Link::connect(self.port.open(self.rig)?)?;
        match link.status()?.state {
            State::Fault(fault) => {
                Err(self.explained(LinkError::Faulted { port: link.port(), fault }, false))
            }
            _ => Ok(()),
        }
    }

    /// Returns how to get a simulated rig for the emulated board at the port; `None` at a port that
    /// is no pseudo-terminal, or where the rig is simulated.
    pub(crate) fn without_simulation(self) -> Option<String> {
        let Self { file, rig, port } = self;
        let port = port.pseudo_terminal(rig).filter(|_| rig.simulation.is_none())?;
        Some(format!(
            "The board seems to be emulated, but {} has no [simulation]: its pictures come from a \
             real camera or from another program. A simulated rig for this board: `plumb init \
             trial --simulated`, then `plumb run --rig trial/rig.toml --port {port}`",
            file.display()
        ))
    }

    /// Returns the failure of a command, `plumb home` if `is_home`. Of a fault it says how to clear
    /// it with the whole command, and of one that was there before also what to do then.
    pub(crate) fn explained(self, error: LinkError, is_home: bool) -> Failure {
        let advice = match error {
            LinkError::Faulted { fault, .. } => self.steps_after(fault, is_home),
            LinkError::Fault(_) => format!("`{}` clears it", self.command("clear")),
            _ => String::new(),
        };
        Failure::from(error).with_advice(advice)
    }

    /// Returns what to do after `fault`, which was there before a command, until it succeeds:
    /// `plumb home` if `is_home`, else another one.
    fn steps_after(self, fault: Fault, is_home: bool) -> String {
        let [clear, jog, home] = ["clear", "jog", "home"].map(|name| self.command(name));
        if !BoardFault::from(fault).asks_for_home() {
            return format!("Run `{clear}`, then this command again");
        }
        let hang = format!("Run `{clear}`, then hang the ball (`{jog}` winds the cables)");
        let place = "with it at a known place";
        match is_home {
            true => format!("{hang}, then this command {place}"),
            false => format!("{hang}, `{home}` {place}, then this command again"),
        }
    }

    /// Returns the command of that name for this board, as a person types it.
    pub(crate) fn command(self, name: &str) -> String {
        format!("plumb {name}{}{}", rig_option(self.file), self.port)
    }
}
