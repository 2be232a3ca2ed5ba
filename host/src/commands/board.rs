//! `plumb board`: commands for the board itself.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::link::{Link, Serial, boards};
use plumb_runtime::rig::Rig;
use serde_json::json;

use super::print::tell;
use super::{Failure, bad_input, print};

/// Ask the board how it is, have it keep a configuration, or send it into its bootloader
#[derive(Parser)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
    /// Serial port of the board [default: the one Plumb board on USB]
    #[arg(long, global = true)]
    port: Option<String>,
    /// Baud rate, where the port is a UART
    #[arg(long, global = true, default_value_t = 115_200)]
    baud: u32,
}

#[derive(Subcommand)]
enum What {
    /// Say what state it is in and where its motors are
    Status {
        /// End with a line of JSON on standard output
        #[arg(long)]
        json: bool,
    },
    /// Configure it by a rig file, and have it keep that over a loss of power
    Save {
        /// The rig file (TOML, SI units)
        rig: PathBuf,
    },
    /// Ramp its motors down and wait for new firmware, as with BOOTSEL held while plugging in
    Bootloader,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let port = args.port.map_or_else(only_board, Ok)?;
    match args.what {
        What::Status { json } => status(&port, &mut open(&port, args.baud)?, json)?,
        What::Save { rig } => {
            let config = Rig::read(&rig)?.config()?;
            let mut link = open(&port, args.baud)?;
            link.configure(config)?;
            link.save()?;
            tell!("{port}: the board keeps the configuration of {}", rig.display());
        }
        What::Bootloader => {
            let serial = Serial::open(&port, args.baud)?;
            Link::bootloader(serial)?;
            tell!("{port}: the board is on its way into its bootloader");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The port of the one board that is plugged in.
fn only_board() -> Result<String, Failure> {
    let found = boards()?;
    match &found[..] {
        [port] => Ok(port.clone()),
        [] => Err(bad_input("no Plumb board is on USB; plug it in, or name its port with --port")),
        several => Err(bad_input(format!(
            "several Plumb boards are on USB; choose one with --port: {}",
            several.join(", ")
        ))),
    }
}

fn open(port: &str, baud: u32) -> Result<Link<Serial>, Failure> {
    Ok(Link::connect(Serial::open(port, baud)?)?)
}

fn status(port: &str, link: &mut Link<Serial>, json: bool) -> Result<(), Failure> {
    let telemetry = link.status()?;
    let motors = telemetry.motors.map(|steps: Steps16| steps.to_si());
    let rates = telemetry.rates.map(|rate: Rate| rate.to_si());
    let [a, b, c] = motors;
    tell!("{port}: {}; motors at {a:.2}, {b:.2}, {c:.2} steps since its start", telemetry.state);
    tell!("{port}: {} damaged frames since its start", telemetry.bad_frames);
    if json {
        let state = telemetry.state.to_string();
        let line = json!({
            "port": port, "state": state, "steps": motors, "rates": rates,
            "bad_frames": telemetry.bad_frames,
        });
        print::result(line)?;
    }
    Ok(())
}
