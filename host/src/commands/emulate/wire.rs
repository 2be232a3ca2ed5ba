//! Options of `plumb emulate` for a link with delay and losses, and for a restart of the board.

use std::time::Duration;

use clap::Args;
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use plumb_runtime::rig::quantity::BAUD;
use plumb_sim::emulator::Wire;
use plumb_sim::emulator::wire::{Lane, Line, Reboot};

use crate::cli::exit::{Failure, failed};
use crate::cli::numbers;

/// Faults of the link to the emulated board, the same in both directions. Without options the link
/// is ideal.
#[derive(Args)]
#[command(next_help_heading = "The link to the board")]
pub(super) struct WireOptions {
    /// Baud rate, which gives the transmission time of a frame, 300 to 20000000 bit/s
    #[arg(long, value_name = "BAUD", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole_within::<u32>(BAUD))]
    baud: Option<u32>,
    /// Transmission time of every frame, as over USB, above 0, to 1e9 s
    #[arg(long, value_name = "S", conflicts_with = "baud", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    frame_time: Option<f64>,
    /// Additional delay of every frame, above 0, to 1e9 s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    latency: Option<f64>,
    /// Share of lost frames, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::SHARE))]
    lost: f64,
    /// Share of damaged frames, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::SHARE))]
    damaged: f64,
    /// Time after which the board restarts, as after a power failure, above 0, to 1e9 s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    reboot_after: Option<f64>,
    /// Seed of the losses and damages, with --lost or --damaged, 0 to 1e15 [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::seed())]
    link_seed: Option<u64>,
}

/// Seed of the losses and damages without an option.
const DEFAULT_SEED: u64 = 1;

impl WireOptions {
    /// Returns the link of the options.
    ///
    /// # Errors
    /// Where there is a seed, and nothing that it would seed.
    pub(super) fn wire(&self) -> Result<Wire, Failure> {
        if self.link_seed.is_some() && self.lost == 0.0 && self.damaged == 0.0 {
            return Err(failed(
                "--link-seed seeds the losses and damages of the link, and this link has none: add \
                 --lost or --damaged",
            ));
        }
        let line = match (self.baud, self.frame_time) {
            (Some(baud), _) => Line::Baud(baud),
            (None, Some(time)) => Line::Frame(Duration::from_secs_f64(time)),
            (None, None) => Line::Instant,
        };
        let latency = Duration::from_secs_f64(self.latency.unwrap_or_default());
        let lane =
            Lane { line, latency, lost: self.lost, damaged: self.damaged, ..Lane::default() };
        let reboot = self.reboot_after.map(|seconds| Reboot {
            at: Micros((seconds * 1e6) as u64),
            cause: StartCause::PowerOn,
        });
        let seed = self.link_seed.unwrap_or(DEFAULT_SEED);
        Ok(Wire { reboots: reboot.into_iter().collect(), ..Wire::symmetric(lane, seed) })
    }
}
