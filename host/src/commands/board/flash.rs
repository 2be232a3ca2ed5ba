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
use plumb_config::bounded_read;
use plumb_image::uf2;
use serde_json::json;

use super::super::print::{result, tell};
use super::super::rig_args::{PortArgs, RIG_VARIABLE};
use super::super::{Failure, bad_input};
use super::{compare_release, firmware_line};
use computer::ThisComputer;
use steps::Greeting;

/// Most bytes of a UF2 file: two for each byte of a Pico's flash.
const MAX_BYTES: u64 = 4 << 20;

/// Firmware of the package, from the folder in which it is installed (`/usr`): scripts/package.
const PACKAGED_FIRMWARE: &str = "share/plumb/firmware/plumb.uf2";

#[derive(Parser)]
pub(super) struct Args {
    /// Firmware, a UF2 file [default: the one of this program's package; without a package
    /// target/firmware/plumb.uf2, which `make firmware` builds]
    #[arg(value_name = "FILE.uf2")]
    file: Option<PathBuf>,
    /// Rig file, for the port and the baud rate of its board [default: the one Plumb board on USB,
    /// or the one Pico in its bootloader]
    #[arg(long, value_name = "RIG", env = RIG_VARIABLE, hide_env_values = true)]
    rig: Option<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn main(args: Args) -> Result<(), Failure> {
    let file = match args.file {
        Some(file) => file,
        None => default_firmware(&std::env::current_exe()?)?,
    };
    let firmware = read(&file)?;
    let named = args.port.board(args.rig.as_deref())?;
    let mut computer = ThisComputer::new(args.port);
    let flashed = steps::flash(&firmware, named, &mut computer)?;
    let (port, Greeting { provenance, start }) = (&flashed.board.port, flashed.greeting);
    let cause = start.map_or_else(|| "not reported".to_owned(), |cause| cause.to_string());
    tell!("{port}: the board is back: {provenance}; cause of its start: {cause}");
    compare_release(port, &provenance);
    if args.json {
        let (start, firmware) = (start.map(|cause| cause.to_string()), firmware_line(&provenance));
        let line = json!({ "port": port, "flashed": file, "start": start, "firmware": firmware });
        result(line)?;
    }
    Ok(())
}

/// Returns the firmware of a command line that names none: the file that the package of `program`
/// has installed, which is of the same release, or the one that `make firmware` has built.
fn default_firmware(program: &Path) -> Result<PathBuf, Failure> {
    let prefix = program.parent().and_then(Path::parent);
    let packaged = prefix.map(|prefix| prefix.join(PACKAGED_FIRMWARE));
    if let Some(packaged) = packaged.filter(|file| file.exists()) {
        return Ok(packaged);
    }
    let built = Path::new("target/firmware/plumb.uf2");
    if built.exists() {
        return Ok(built.to_owned());
    }
    Err(bad_input(format!(
        "{}: there is no firmware here; build it with `make firmware`, or name a UF2 file",
        built.display()
    )))
}

/// Reads a UF2 file, and checks that a Pico accepts it.
fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    let name = file.display();
    let firmware = bounded_read::read(file, MAX_BYTES)?;
    let size = uf2::check(&firmware).map_err(|error| bad_input(format!("{name}: {error}")))?;
    tell!("{name}: firmware of {size} bytes");
    Ok(firmware)
}
