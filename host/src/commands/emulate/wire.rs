//! A link that takes time, loses frames and sees the board restart, for `plumb emulate`.

use std::time::Duration;

use clap::Args;
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use plumb_sim::emulator::Wire;
use plumb_sim::emulator::wire::{Lane, Line, Reboot};

use super::super::numbers;

/// What the link to the emulated board does, the same in both directions; an ideal one without
/// options.
#[derive(Args)]
#[command(next_help_heading = "The link to the board")]
pub(super) struct WireOptions {
    /// Frames take their time at this baud rate
    #[arg(
        long,
        value_name = "BAUD",
        value_parser = clap::value_parser!(u32).range(300..=20_000_000)
    )]
    baud: Option<u32>,
    /// Every frame takes this time, as over USB, seconds
    #[arg(long, value_name = "S", conflicts_with = "baud", value_parser = numbers::seconds)]
    frame_time: Option<f64>,
    /// Frames arrive so much later, seconds
    #[arg(long, value_name = "S", value_parser = numbers::seconds)]
    latency: Option<f64>,
    /// Share of the frames that is lost, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = numbers::share)]
    lost: f64,
    /// Share of the frames that is damaged, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = numbers::share)]
    damaged: f64,
    /// The board restarts after this time, as if its supply had failed, seconds
    #[arg(long, value_name = "S", value_parser = numbers::seconds)]
    reboot_after: Option<f64>,
    /// Seed of what is lost and damaged
    #[arg(long, value_name = "N", default_value_t = 1)]
    link_seed: u64,
}

impl WireOptions {
    /// The link that was asked for.
    pub(super) fn wire(&self) -> Wire {
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
        Wire { reboots: reboot.into_iter().collect(), ..Wire::symmetric(lane, self.link_seed) }
    }
}
