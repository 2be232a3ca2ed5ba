//! The reference of a path, in telemetry.

use plumb_protocol::config::PathLimits;
use plumb_protocol::message::{Command, FromBoard, State, Telemetry};
use plumb_protocol::units::Micros;

use super::super::event::{Delivery, Ticked};
use super::limits::Limits;
use crate::campaign::Outcome;

/// The reference never jumps, and keeps to its speed, whatever path the host sends.
pub(super) const REFERENCE: &str = "the reference keeps to its speed";

/// Rate at which the reference corrects its velocity, 1/s.
const VELOCITY_GAIN: f64 = 16.0;
/// Period of the reference's states, s.
const STEP_S: f64 = 0.016;
/// Rounding of a position in telemetry, µm: single precision within 4 m, and the unit.
const ROUNDING_UM: f64 = 4.0;

/// Checker of [`REFERENCE`].
#[derive(Debug, Clone, Default)]
pub(super) struct ReferenceSpeed {
    /// Time and position (µm) in the last telemetry of the path under way.
    last: Option<(Micros, [i32; 3])>,
}

/// Returns the highest speed of a reference, µm/s. Its acceleration is limited, and so is the
/// change of that. Therefore a path with a high acceleration drives it beyond the configured speed
/// by what it takes to turn the acceleration round.
pub(super) fn highest_speed(limits: &PathLimits) -> f64 {
    let (speed, acceleration) = (f64::from(limits.speed.0), f64::from(limits.acceleration.0) * 1e3);
    let jerk = f64::from(limits.jerk.0) * 1e3;
    let beyond = 1.0 / VELOCITY_GAIN + STEP_S + 2.0 * acceleration / jerk;
    speed + acceleration * beyond
}

impl ReferenceSpeed {
    /// Takes in the messages after a frame. A path that begins anew begins at the ball.
    pub(super) fn delivered(
        &mut self,
        delivery: &Delivery<'_>,
        limits: Option<&Limits>,
        outcome: &mut Outcome,
    ) {
        let is_path = |command: &Command| matches!(command, Command::Follow(_));
        let begins = delivery.before.state != State::Following
            && delivery.accepted().is_some_and(|message| is_path(&message.command));
        if begins || delivery.after.state != State::Following {
            self.last = None;
        }
        if let Some(limits) = limits {
            delivery.replies.iter().for_each(|reply| self.hear(reply, limits, outcome));
        }
    }

    /// Takes in the messages of a tick.
    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, limits: &Limits, outcome: &mut Outcome) {
        if ticked.after.state != State::Following {
            self.last = None;
        }
        ticked.replies.iter().for_each(|reply| self.hear(reply, limits, outcome));
    }

    fn hear(&mut self, reply: &FromBoard, limits: &Limits, outcome: &mut Outcome) {
        let FromBoard::Telemetry(telemetry) = reply else { return };
        let Telemetry { time, state: State::Following, reference: Some(reference), .. } = telemetry
        else {
            return;
        };
        let position = reference.position.micrometres();
        if let Some((since, before)) = self.last.replace((*time, position)) {
            let squares = [0, 1, 2].map(|i| f64::from(position[i].abs_diff(before[i])).powi(2));
            let moved = squares.iter().sum::<f64>().sqrt();
            // A frame may come within a tick; its answer is then before the tick's telemetry.
            let between_us = time.0.abs_diff(since.0) as f64;
            let allowed = highest_speed(&limits.path) * between_us * 1e-6 + ROUNDING_UM;
            outcome.check(moved <= allowed, REFERENCE, || {
                format!("{moved:.0} of {allowed:.0} um, {:?}", limits.path)
            });
        }
    }
}
