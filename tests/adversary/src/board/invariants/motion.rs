//! Motion: pulses and positions, rates, accelerations, travel.

use plumb_core::timing::TICK_CLOCKS;
use plumb_protocol::message::{Command, Hello, State, ToBoard};

use super::super::event::{Cut, Delivery, Ticked};
use super::limits::{Limits, MotorLimits};
use crate::campaign::Outcome;

/// Without a configuration no motor moves.
pub(super) const CONFIGURED: &str = "no motion without a configuration";
/// A motor's position changes by exactly its pulses, and by emergency stops.
pub(super) const POSITIONS: &str = "positions advance by the pulses";
/// The zero of travel changes by an accepted Home only, which makes the present positions zero.
pub(super) const ZERO: &str = "only Home changes the zero of travel";
/// All pulses are within their tick.
pub(super) const PULSES: &str = "pulses lie within the tick";
/// No rate is above the motor's limit, and neither is the number of pulses in a tick.
pub(super) const RATE: &str = "rates within the limits";
/// No rate changes faster than the motor's acceleration allows, in a tick and in 64.
pub(super) const ACCELERATION: &str = "accelerations within the limits";
/// No motor passes the end of its travel, not even by one pulse.
pub(super) const TRAVEL: &str = "no motor passes its travel";
/// A motor outside its travel, after a new configuration, moves inwards only, and slowly.
pub(super) const WAY_BACK: &str = "a motor outside its travel crawls inwards";

/// Maximum rate of a motor outside its travel, Q8 steps/s.
const CRAWL: i32 = 20 << 8;

/// Checks that a message does not change positions.
pub(super) fn check_delivery(delivery: &Delivery<'_>, outcome: &mut Outcome) {
    let Delivery { before, after, message, .. } = delivery;
    outcome.check(before.positions == after.positions, POSITIONS, || {
        format!("{message:?} moved motors")
    });
    let is_home = |message: ToBoard| message.command == Command::Home;
    let homed = !delivery.repeated && delivery.accepted().is_some_and(is_home);
    let holds = if homed {
        before.state == State::Ready && after.travel == [0; 3]
    } else {
        after.travel == before.travel
    };
    outcome.check(holds, ZERO, || format!("{before:?} to {after:?} by {message:?}"));
}

/// Checks the pulses of a tick.
pub(super) fn check_tick(ticked: &Ticked<'_>, limits: Option<&Limits>, outcome: &mut Outcome) {
    let Some(limits) = limits else {
        let rest = ticked.after.positions == ticked.before.positions;
        let still = rest && !ticked.pulses() && ticked.after.rates == [0; 3];
        return outcome.check(still, CONFIGURED, || format!("{ticked:?}"));
    };
    for (i, limits) in limits.motors.iter().enumerate() {
        check_pulses(ticked, i, limits, outcome);
        check_travel(ticked, i, limits, outcome);
        let (rate, most) = (ticked.after.rates[i], limits.motor.max_rate.0);
        let count = ticked.plan.motors[i].count;
        let within = rate.abs() <= most && count <= limits.pulses;
        outcome.check(within, RATE, || {
            format!("motor {i}: {rate} of {most} Q8 steps/s, {count} pulses")
        });
    }
}

fn check_pulses(ticked: &Ticked<'_>, i: usize, limits: &MotorLimits, outcome: &mut Outcome) {
    let pulses = ticked.plan.motors[i];
    let count = i32::from(pulses.count);
    let signed = if pulses.direction == limits.motor.reversed { -count } else { count };
    let way = signed * limits.pulse;
    let (before, after) = (ticked.before.positions[i], ticked.after.positions[i]);
    let travelled = ticked.after.travel[i] - ticked.before.travel[i];
    outcome.check(after == before + way && travelled == way, POSITIONS, || {
        format!("motor {i}: {before} to {after}: {pulses:?}")
    });
    let periods = u64::from(pulses.count.saturating_sub(1));
    let last = u64::from(pulses.first) + periods * u64::from(pulses.period);
    let within = count == 0 || (last < u64::from(TICK_CLOCKS) && pulses.period <= TICK_CLOCKS);
    outcome.check(within, PULSES, || format!("motor {i}: {pulses:?}"));
}

fn check_travel(ticked: &Ticked<'_>, i: usize, limits: &MotorLimits, outcome: &mut Outcome) {
    let (before, after) = (ticked.before.travel[i], ticked.after.travel[i]);
    let (was, is) = (limits.beyond(before), limits.beyond(after));
    if is <= 0 {
        return;
    }
    let rate = ticked.after.rates[i];
    let detail =
        || format!("motor {i}: {before} to {after} at {rate} Q8 steps/s, {:?}", limits.motor);
    if was <= 0 {
        outcome.broken(TRAVEL, detail);
    } else {
        outcome.tally.add("ticks of a way back", (is < was).into());
        outcome.check(is <= was && rate.abs() <= CRAWL, WAY_BACK, detail);
    }
}

/// Checks that an emergency stop subtracts the missing pulses from the positions.
pub(super) fn check_cut(cut: &Cut<'_>, limits: Option<&Limits>, outcome: &mut Outcome) {
    let Cut { missing, before, after, .. } = cut;
    let back = |i: usize| {
        let motor = limits.map(|limits| limits.motors[i]);
        motor.map_or(0, |m| missing[i] * if m.motor.reversed { -m.pulse } else { m.pulse })
    };
    let expected = [0, 1, 2].map(|i| before.positions[i] - back(i));
    let holds = after.positions == expected && after.rates == [0; 3];
    outcome.check(holds, POSITIONS, || format!("cut by {missing:?}: {before:?} to {after:?}"));
}

/// Length of the longer window, ticks.
const WINDOW: usize = 64;

/// Checker of [`ACCELERATION`].
#[derive(Debug, Clone)]
pub(super) struct Acceleration {
    /// Rates in the last ticks, Q8 steps/s.
    rates: [[i32; 3]; WINDOW],
    tick: usize,
}

impl Default for Acceleration {
    /// Returns the checker for motors at rest.
    fn default() -> Self {
        Self { rates: [[0; 3]; WINDOW], tick: 0 }
    }
}

impl Acceleration {
    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, limits: &Limits, outcome: &mut Outcome) {
        let rates = ticked.after.rates;
        let last = self.rates[(self.tick + WINDOW - 1) % WINDOW];
        let first = std::mem::replace(&mut self.rates[self.tick], rates);
        self.tick = (self.tick + 1) % WINDOW;
        for (i, limits) in limits.motors.iter().enumerate() {
            let (change, window) = (rates[i].abs_diff(last[i]), rates[i].abs_diff(first[i]));
            let within = limits.allows(change, 1) && limits.allows(window, WINDOW as u64);
            outcome.check(within, ACCELERATION, || {
                format!(
                    "motor {i}: by {change} in a tick, {window} in {WINDOW}, {:?}",
                    limits.motor
                )
            });
        }
    }
}

/// Returns whether this command, if accepted, starts motion.
pub(super) fn begins_motion(command: &Command) -> bool {
    matches!(command, Command::Target(_) | Command::Jog(_) | Command::Hold | Command::Follow(_))
}

/// Returns whether this command, if accepted, ends motion.
pub(super) fn ends_motion(command: &Command) -> bool {
    match command {
        Command::Stop | Command::Bootloader => true,
        Command::Hello(hello) => *hello != Hello::OURS,
        _ => false,
    }
}
