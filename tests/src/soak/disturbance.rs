//! What goes wrong in a session.

use std::time::Duration;

use plumb_emulator::Wire;
use plumb_emulator::wire::{Lane, Line, Reboot, Silence};
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use rand::{Rng, RngExt};

/// Failure in a session, at a time on the board's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// None.
    None,
    /// The link is slow, and loses, damages and doubles frames.
    PoorLink,
    /// The link is interrupted for a second.
    LinkCut(Micros),
    /// The watchdog restarts the board.
    Restart(Micros),
    /// The camera delivers nothing for this time, seconds.
    CameraGap(Micros, f64),
    /// The cable is pulled, until the next session.
    CablePulled(Micros),
}

impl Disturbance {
    /// Draws a disturbance within the `length` of a session (seconds) that begins `now`.
    pub(super) fn draw(random: &mut impl Rng, now: Micros, length: f64) -> Self {
        let instant = random.random_range(1.0..length.max(2.0));
        let at = Micros(now.0 + (instant * 1e6) as u64);
        match random.random_range(0..10) {
            0..5 => Self::None,
            5 => Self::PoorLink,
            6 => Self::LinkCut(at),
            7 => Self::Restart(at),
            8 => Self::CameraGap(at, random.random_range(0.2..2.0)),
            _ => Self::CablePulled(at),
        }
    }

    /// Returns the name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::PoorLink => "poor link",
            Self::LinkCut(_) => "link cut for 1 s",
            Self::Restart(_) => "board restarts",
            Self::CameraGap(..) => "camera pauses 0.2 to 2 s",
            Self::CablePulled(_) => "cable pulled",
        }
    }

    /// Returns the link of a session.
    pub(super) fn wire(self, seed: u64) -> Wire {
        let lane = Lane { latency: Duration::from_millis(2), ..Lane::on(Line::Baud(921_600)) };
        let good = Wire::symmetric(lane.clone(), seed);
        match self {
            Self::PoorLink => {
                let latency = Duration::from_millis(15);
                let poor = Lane { latency, lost: 0.03, damaged: 0.02, doubled: 0.02, ..lane };
                Wire::symmetric(poor, seed)
            }
            Self::LinkCut(from) => {
                let silence = Silence { from, to: Micros(from.0 + 1_000_000) };
                Wire { silences: vec![silence], ..good }
            }
            Self::CablePulled(from) => {
                let silence = Silence { from, to: Micros(u64::MAX) };
                Wire { silences: vec![silence], ..good }
            }
            Self::Restart(at) => {
                let reboot = Reboot { at, cause: StartCause::Watchdog };
                Wire { reboots: vec![reboot], ..good }
            }
            Self::None | Self::CameraGap(..) => good,
        }
    }

    /// Returns whether a session with it may end for another cause than the operator's.
    pub(super) fn may_end_a_session(self) -> bool {
        self != Self::None
    }
}
