//! `plumb board`: service of the board itself.

mod flash;
mod selftest;
pub(crate) mod status;

use clap::{Parser, Subcommand};
use plumb_runtime::link::{Link, Transport};
use serde_json::json;

use crate::cli::exit::{Exit, Failure, Work};
use crate::cli::port_args::BoardArgs;
use crate::cli::print;
use crate::session::connection::RigBoard;

/// Ask the board for its state, store a configuration in it, or write new firmware to it
#[derive(Parser)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Print the board's program, state and motor positions, and what it has counted
    #[command(after_help = examples!["plumb board status", "plumb board status --json"])]
    Status(BoardArgs),
    /// Configure the board by a rig file, and store that for the time after a loss of power
    #[command(after_help = examples!["plumb board save"])]
    Save(BoardArgs),
    /// Test the board's pulses, flash and clock, with the motors' supply off
    #[command(after_help = examples![
        "plumb board selftest",
        "plumb board selftest --yes --out selftest.json",
    ])]
    Selftest(selftest::Args),
    /// Ramp the motors down and wait for new firmware, as with BOOTSEL held while plugging in
    #[command(after_help = examples![
        "plumb board bootloader",
        "plumb board bootloader --port /dev/ttyACM0",
    ])]
    Bootloader(BoardArgs),
    /// Write firmware to the board: bootloader, its drive, and the board back on its port
    #[command(after_help = examples![
        "plumb board flash",
        "plumb board flash plumb.uf2 --port /dev/ttyACM0",
    ])]
    Flash(flash::Args),
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    match args.what {
        What::Status(args) => {
            let mut link = Link::connect(args.open()?)?;
            Ok(Box::new(move || status::tell(&mut link, args.json)))
        }
        What::Save(args) => save(args),
        What::Flash(args) => flash::prepare(args),
        What::Selftest(args) => selftest::prepare(args),
        What::Bootloader(args) => {
            let serial = args.open()?;
            Ok(Box::new(move || {
                let port = serial.name();
                Link::bootloader(serial)?;
                tell!("{port}: the board has restarted into its bootloader");
                print::json(args.json, json!({ "port": port, "bootloader": true }))?;
                Ok(Exit::Done)
            }))
        }
    }
}

fn save(args: BoardArgs) -> Result<Work, Failure> {
    let (file, rig) = args.rig.read()?;
    let mut link = RigBoard { file: &file, rig: &rig, port: &args.port }.connect(false)?;
    Ok(Box::new(move || {
        link.save()?;
        let port = link.port();
        tell!("{port}: the board keeps the configuration of {}", file.display());
        print::json(args.json, json!({ "port": port, "saved": file }))?;
        Ok(Exit::Done)
    }))
}
