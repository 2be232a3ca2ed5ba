//! This computer, for the steps of a flash.

use std::io;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use plumb_image::chip::Chip;
use plumb_runtime::link::{Link, LinkError, Serial, boards};
use plumb_runtime::rig::BoardPort;

use super::drive::{self, DriveSearch, Drives, Written};
use super::steps::{Computer, Greeting};
use crate::cli::port_args::PortArgs;

/// Ports, drives and clock of this computer.
pub(super) struct ThisComputer {
    drives: DriveSearch,
    options: PortArgs,
    begin: Instant,
}

impl ThisComputer {
    /// Returns this computer, for boards with this chip; ports are opened with the baud rate of
    /// `options`.
    pub(super) fn new(options: PortArgs, chip: &'static Chip) -> Self {
        Self { drives: DriveSearch::linux(chip), options, begin: Instant::now() }
    }
}

impl Computer for ThisComputer {
    fn boards(&mut self) -> Result<Vec<String>, LinkError> {
        boards()
    }

    fn board_at(&self, port: String) -> BoardPort {
        self.options.board_at(port)
    }

    fn has_port(&mut self, port: &str) -> bool {
        Path::new(port).exists()
    }

    fn enter_bootloader(&mut self, board: &BoardPort) -> Result<(), LinkError> {
        Link::bootloader(Serial::open(&board.port, board.baud)?)
    }

    fn drives(&mut self) -> io::Result<Drives> {
        self.drives.find()
    }

    fn write(&mut self, folder: &Path, firmware: &[u8]) -> io::Result<Written> {
        let mut quarters = 0;
        drive::write(folder, firmware, |done| {
            let reached = 4 * done / firmware.len().max(1);
            if reached > quarters {
                quarters = reached;
                tell!("{}: {} % written", folder.display(), 25 * reached);
            }
        })
    }

    fn greet(&mut self, board: &BoardPort) -> Result<Greeting, LinkError> {
        let mut link = Link::connect(Serial::open(&board.port, board.baud)?)?;
        Ok(Greeting { provenance: link.provenance()?, start: link.ask_start_cause() })
    }

    fn now(&self) -> Duration {
        self.begin.elapsed()
    }

    fn wait(&mut self, duration: Duration) {
        thread::sleep(duration);
    }

    fn report(&mut self, text: &str) {
        tell!("{text}");
    }
}
