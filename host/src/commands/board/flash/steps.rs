//! The steps from a firmware to a board that runs it.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use plumb_protocol::Provenance;
use plumb_protocol::message::StartCause;
use plumb_runtime::link::{LinkError, other_port};
use plumb_runtime::rig::BoardPort;
use thiserror::Error;

use super::drive::{Drives, Written};

/// Longest wait for the drive of a board that has gone into its bootloader: the computer finds and
/// mounts it.
const DRIVE_TIMEOUT: Duration = Duration::from_secs(15);
/// Longest wait for a board that has its firmware: the boot ROM takes a second to restart it
/// (pico-bootrom-rp2040, `virtual_disk.c`), and the computer then sets up the port.
const BACK_TIMEOUT: Duration = Duration::from_secs(20);
/// Interval between two looks.
const INTERVAL: Duration = Duration::from_millis(250);

/// What the steps need of a computer; a fake in the tests.
pub(super) trait Computer {
    /// Returns the ports of the boards on USB.
    fn boards(&mut self) -> Result<Vec<String>, LinkError>;
    /// Returns the board at `port`.
    fn board_at(&self, port: String) -> BoardPort;
    /// Returns whether there is such a port.
    fn has_port(&mut self, port: &str) -> bool;
    /// Sends a board into its bootloader, and waits until it has gone.
    fn enter_bootloader(&mut self, board: &BoardPort) -> Result<(), LinkError>;
    /// Returns the drives of boards in their bootloader.
    fn drives(&mut self) -> io::Result<Drives>;
    /// Writes the firmware to the drive at `folder`.
    fn write(&mut self, folder: &Path, firmware: &[u8]) -> io::Result<Written>;
    /// Greets a board, and returns what it tells of its program.
    fn greet(&mut self, board: &BoardPort) -> Result<Greeting, LinkError>;
    /// Returns the time since any moment.
    fn now(&self) -> Duration;
    /// Lets time pass.
    fn wait(&mut self, duration: Duration);
    /// Reports a step.
    fn report(&mut self, text: &str);
}

/// Reason why a board did not get its firmware.
#[derive(Debug, Error)]
pub(crate) enum FlashError {
    /// There is nothing to write to.
    #[error(
        "no Plumb board is on USB, and no Pico in its bootloader: hold BOOTSEL while plugging the \
         Pico in (an SKR Pico has the jumper Boot for that), wait for its drive (RPI-RP2, or \
         RP2350 of a Pico 2), and run this command again; a board on a UART needs --port"
    )]
    NoBoard,
    /// The port that is named does not exist, and no drive is there.
    #[error(
        "{port}: there is no such serial port, and no Pico is in its bootloader: plug the board \
         in. For its first firmware hold BOOTSEL while plugging it in (an SKR Pico has the jumper \
         Boot for that), wait for its drive (RPI-RP2, or RP2350 of a Pico 2), and run this command \
         again"
    )]
    NoNamedBoard {
        /// Port that is named.
        port: String,
    },
    /// Several boards run.
    #[error("several Plumb boards are on USB; choose one with --port: {}", .0.join(", "))]
    SeveralBoards(Vec<String>),
    /// Several boards are in their bootloader.
    #[error("several Picos are in their bootloader; unplug all but one: {}", list(.0))]
    SeveralDrives(Vec<PathBuf>),
    /// The board that is named runs, and another one is in its bootloader.
    #[error(
        "{port}: another Pico, with the drive {}, waits in its bootloader: unplug it to flash this \
         board, or unplug this board to flash that one", .drive.display()
    )]
    DriveBesideBoard {
        /// Port of the board.
        port: String,
        /// The other one's drive.
        drive: PathBuf,
    },
    /// The mounted drives are not known.
    #[error(
        "the mounted drives cannot be listed; copy the file to the drive RPI-RP2 of a Pico, or \
         RP2350 of a Pico 2, in its bootloader"
    )]
    Mounts(#[source] io::Error),
    /// The drive is there, and not mounted.
    #[error(
        "the Pico is in its bootloader, but its drive is not mounted: open it in the file \
         manager, or run `udisksctl mount -b {}`; then run this command again", .device.display()
    )]
    NotMounted {
        /// Device file of the drive.
        device: PathBuf,
    },
    /// The board has gone, and its drive does not come.
    #[error(
        "{port}: the board has gone into its bootloader, but no drive for this firmware has \
         come within {:.0} s: unplug the board, plug it in by USB with BOOTSEL held, and run this \
         command again; a cable for charging only shows no drive", .waited.as_secs_f64()
    )]
    NoDrive {
        /// Port that the board had.
        port: String,
        /// Time that the host waited.
        waited: Duration,
    },
    /// The drive does not take the firmware.
    #[error("{}: {}", .drive.display(), advice(.source))]
    Write {
        /// Folder of the drive.
        drive: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The firmware is written, and no board answers.
    #[error(
        "the firmware is written, but no board has answered within {:.0} s: plug the Pico in again \
         and run `plumb board status`; if the bootloader's drive comes back, the flash holds no \
         program that starts: flash it again", .waited.as_secs_f64()
    )]
    NotBack {
        /// Time that the host waited.
        waited: Duration,
        /// Error of the last attempt, where there was a port.
        source: Option<LinkError>,
    },
    /// The link to the board failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

fn list(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Returns what a failed write means, and what to do next.
fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::ReadOnlyFilesystem => {
            "the drive is mounted read-only: unmount it, plug the Pico in again with BOOTSEL held, \
             and run this command again"
        }
        io::ErrorKind::PermissionDenied => {
            "this user may not write to the drive: mount it as this user (`udisksctl mount`), and \
             run this command again"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the drive has no room, which the boot ROM's always has: plug the Pico in again with \
             BOOTSEL held, and run this command again"
        }
        _ => {
            "the drive went away before the firmware was whole: plug the Pico in again with \
             BOOTSEL held, with another cable or port, and run this command again"
        }
    }
}

/// A board with new firmware.
#[derive(Debug)]
pub(super) struct Flashed {
    /// Its port.
    pub(super) board: BoardPort,
    /// What it tells.
    pub(super) greeting: Greeting,
}

/// What a board tells after its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Greeting {
    /// Its program and chip.
    pub(super) provenance: Provenance,
    /// Cause of its start, if it reports one.
    pub(super) start: Option<StartCause>,
}

/// Where the firmware goes.
#[derive(Debug)]
pub(super) enum Destination {
    /// A board that runs.
    Board(BoardPort),
    /// A board in its bootloader.
    Drive,
}

/// Writes a checked firmware to `destination`, and waits until the board runs.
///
/// # Errors
/// The step that failed.
pub(super) fn flash(
    firmware: &[u8],
    destination: Destination,
    computer: &mut impl Computer,
) -> Result<Flashed, FlashError> {
    if let Destination::Board(board) = &destination {
        computer.enter_bootloader(board)?;
        computer.report(&format!("{}: told to restart into its bootloader", board.port));
    }
    let drive = wait_for_drive(&destination, computer)?;
    let others = computer.boards()?;
    computer.report(&format!("{}: writing", drive.display()));
    match computer.write(&drive, firmware) {
        Ok(Written::Confirmed) => {}
        Ok(Written::Gone(error)) => computer.report(&format!(
            "{}: gone with the last block, as after a restart ({error})",
            drive.display()
        )),
        Err(source) => return Err(FlashError::Write { drive, source }),
    }
    wait_for_board(destination, &others, computer)
}

/// Chooses the board or the drive to write to: the board that is `named`, or else the one that is
/// there.
pub(super) fn choose(
    named: Option<BoardPort>,
    computer: &mut impl Computer,
) -> Result<Destination, FlashError> {
    let Drives { mounted, device } = computer.drives().map_err(FlashError::Mounts)?;
    if mounted.len() > 1 {
        return Err(FlashError::SeveralDrives(mounted));
    }
    let drive = mounted.into_iter().next().or(device);
    match (named, drive) {
        (Some(board), drive) if computer.has_port(&board.port) => match drive {
            Some(drive) => Err(FlashError::DriveBesideBoard { port: board.port, drive }),
            None => Ok(Destination::Board(board)),
        },
        (_, Some(_)) => Ok(Destination::Drive),
        (Some(board), None) if other_port(&board.port).is_some() => {
            Err(LinkError::Absent { port: board.port }.into())
        }
        (Some(board), None) => Err(FlashError::NoNamedBoard { port: board.port }),
        (None, None) => match &computer.boards()?[..] {
            [port] => Ok(Destination::Board(computer.board_at(port.clone()))),
            [] => Err(FlashError::NoBoard),
            several => Err(FlashError::SeveralBoards(several.to_vec())),
        },
    }
}

/// Waits for the one drive of a board in its bootloader.
fn wait_for_drive(
    destination: &Destination,
    computer: &mut impl Computer,
) -> Result<PathBuf, FlashError> {
    let begin = computer.now();
    loop {
        let Drives { mounted, device } = computer.drives().map_err(FlashError::Mounts)?;
        match &mounted[..] {
            [drive] => return Ok(drive.clone()),
            [] => {}
            _ => return Err(FlashError::SeveralDrives(mounted)),
        }
        let waited = computer.now().saturating_sub(begin);
        if waited >= DRIVE_TIMEOUT {
            return Err(match (device, destination) {
                (Some(device), _) => FlashError::NotMounted { device },
                (None, Destination::Drive) => FlashError::NoBoard,
                (None, Destination::Board(board)) => {
                    FlashError::NoDrive { port: board.port.clone(), waited }
                }
            });
        }
        computer.wait(INTERVAL);
    }
}

/// Waits until a board answers: at the port that it had, or at one that is none of `others`, which
/// were there while the board was in its bootloader.
fn wait_for_board(
    destination: Destination,
    others: &[String],
    computer: &mut impl Computer,
) -> Result<Flashed, FlashError> {
    computer.report("written; waiting for the board");
    let (begin, mut source) = (computer.now(), None);
    loop {
        // The list may fail for a moment while a port appears.
        let ports = computer.boards().unwrap_or_default();
        let new = ports.into_iter().filter(|port| !others.contains(port));
        let mut candidates: Vec<_> = new.map(|port| computer.board_at(port)).collect();
        if let Destination::Board(board) = &destination
            && computer.has_port(&board.port)
            && candidates.iter().all(|candidate| candidate.port != board.port)
        {
            candidates.insert(0, board.clone());
        }
        for board in candidates {
            match computer.greet(&board) {
                Ok(greeting) => return Ok(Flashed { board, greeting }),
                // It runs another release, and says so itself.
                Err(error @ LinkError::Version { .. }) => return Err(error.into()),
                Err(error) => source = Some(error),
            }
        }
        let waited = computer.now().saturating_sub(begin);
        if waited >= BACK_TIMEOUT {
            return Err(FlashError::NotBack { waited, source });
        }
        computer.wait(INTERVAL);
    }
}
