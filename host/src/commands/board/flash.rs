//! `plumb board flash`: new firmware for the board, by the drive of its bootloader.
//!
//! ```text
//! UF2 file -> checked -> bootloader -> drive found -> written -> board back -> greeted
//! ```

mod computer;
mod drive;
mod steps;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use clap::Parser;
use plumb_cameras::camera_file::is_rig_file;
use plumb_config::bounded_read;
use plumb_image::chip::{ALL, Chip, RP2040, RP2350};
use plumb_image::uf2;
use plumb_protocol::boards;
use plumb_protocol::provenance::BoardKind;
use plumb_runtime::link::{Link, Serial};
use plumb_runtime::rig::{BoardPort, Rig};
use serde_json::json;

use super::status::{compare_release, firmware_line};
use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::port_args::PortArgs;
use crate::cli::print;
use crate::cli::rig_path::RigArg;
use computer::ThisComputer;
use drive::{DriveSearch, Drives};
use steps::{FlashError, Greeting};

/// Most bytes of a UF2 file: two for each byte of a Pico 2's flash, and a block.
const MAX_BYTES: u64 = (8 << 20) + 512;

/// Folder with the firmware of the package, from the one in which it is installed (`/usr`):
/// scripts/package.
const PACKAGED_FIRMWARE: &str = "share/plumb/firmware";

#[derive(Parser)]
pub(super) struct Args {
    /// Firmware, a UF2 file [default: the one for the board's chip in this program's package;
    /// without a package target/firmware/plumb.uf2 or plumb-pico2.uf2, which `make firmware`
    /// builds]
    #[arg(value_name = "FILE.uf2")]
    file: Option<PathBuf>,
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn prepare(args: Args) -> Result<Work, Failure> {
    let rig = args.rig.found();
    let board = args.port.board(rig.as_deref())?;
    let file = match args.file {
        Some(file) => file,
        None => {
            let chip = chip(rig.as_deref(), board.as_ref(), &args.port)?;
            default_firmware(chip, &std::env::current_exe()?)?
        }
    };
    let (firmware, chip) = read(&file)?;
    let mut computer = ThisComputer::new(args.port, chip);
    let destination = steps::choose(board, &mut computer)?;
    Ok(Box::new(move || {
        let flashed = steps::flash(&firmware, destination, &mut computer);
        let flashed = flashed.map_err(|error| match error {
            FlashError::Link(error) => Failure::from(error),
            error => error.into(),
        })?;
        let (port, Greeting { provenance, start }) = (&flashed.board.port, flashed.greeting);
        let start = start.map(|cause| cause.to_string());
        let cause = start.as_deref().unwrap_or("not reported");
        tell!("{port}: the board is back: {provenance}; cause of its start: {cause}");
        compare_release(port, &provenance);
        let firmware = firmware_line(&provenance);
        let line = json!({ "port": port, "flashed": file, "start": start, "firmware": firmware });
        print::json(args.json, line)?;
        Ok(Exit::Done)
    }))
}

/// Returns the chip of the board that a command line without a firmware means: that of the rig
/// file's kind of board; else that of a bootloader's drive; else that of the board on USB. An
/// RP2040 where none of them tells it.
fn chip(
    rig: Option<&Path>,
    named: Option<&BoardPort>,
    options: &PortArgs,
) -> Result<&'static Chip, Failure> {
    if let Some(rig) = rig {
        return Ok(match Rig::read(rig)?.board.kind.board().chip {
            boards::Chip::Rp2040 => &RP2040,
            boards::Chip::Rp2350 => &RP2350,
        });
    }
    let drive = ALL.into_iter().find(|chip| {
        DriveSearch::linux(chip).find().is_ok_and(|drives| drives != Drives::default())
    });
    if let Some(chip) = drive {
        return Ok(chip);
    }
    let found = plumb_runtime::link::boards().unwrap_or_default();
    let only = || match &found[..] {
        [port] => Some(options.board_at(port.clone())),
        _ => None,
    };
    let kind = named.cloned().or_else(only).and_then(|board| {
        let mut link = Link::connect(Serial::open(&board.port, board.baud).ok()?).ok()?;
        Some(link.provenance().ok()?.board)
    });
    Ok(if kind == Some(BoardKind::Pico2) { &RP2350 } else { &RP2040 })
}

/// Returns the firmware of a command line that names none: the file that the package of `program`
/// has installed, which is of the same release, or the one that `make firmware` has built.
fn default_firmware(chip: &Chip, program: &Path) -> Result<PathBuf, Failure> {
    let (name, board) =
        if *chip == RP2350 { ("plumb-pico2.uf2", " BOARD=pico2") } else { ("plumb.uf2", "") };
    let prefix = program.parent().and_then(Path::parent);
    let packaged = prefix.map(|prefix| prefix.join(PACKAGED_FIRMWARE).join(name));
    if let Some(packaged) = packaged.filter(|file| file.exists()) {
        return Ok(packaged);
    }
    let built = Path::new("target/firmware").join(name);
    if built.exists() {
        return Ok(built);
    }
    Err(failed(format!(
        "{}: there is no firmware here; build it with `make firmware{board}`, or name a UF2 file",
        built.display()
    )))
}

/// Reads a UF2 file, and checks that its chip accepts it.
fn read(file: &Path) -> Result<(Vec<u8>, &'static Chip), Failure> {
    let name = file.display();
    let firmware = bounded_read::read(file, MAX_BYTES)?;
    let uf2::Firmware { chip, size } = uf2::check(&firmware).map_err(|error| {
        failed(match std::str::from_utf8(&firmware).is_ok_and(is_rig_file) {
            true => format!("{name}: this is a rig file, and no UF2 file: give it with --rig"),
            false => format!("{name}: {error}"),
        })
    })?;
    tell!("{name}: firmware of {size} bytes for {}", chip.name);
    Ok((firmware, chip))
}
