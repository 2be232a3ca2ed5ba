//! Invariants of the chip, from the edges on its STEP and DIR pins and from its messages.

use std::collections::VecDeque;

use plumb_protocol::message::{Fault, State, Telemetry};
use plumb_protocol::units::{Micros, Steps16};

use crate::kind::Kind;
use crate::plan::Plan;

/// Ticks of 1 ms in a window for rates and accelerations.
const WINDOW: usize = 20;
/// Length of the window, s.
const WINDOW_S: f64 = 0.020;
/// A pulse, full steps.
const PULSE: f64 = 1.0 / 16.0;
/// Time from a message or a restart to its effect on the pins, µs.
const SLACK_US: u64 = 20_000;
/// Time of the watchdog, µs.
const WATCHDOG_US: u64 = 200_000;

/// No rate is above the motor's limit.
const RATE: &str = "rates within the limits";
/// No rate changes faster than the motor's acceleration allows.
const ACCELERATION: &str = "accelerations within the limits";
/// The pulses on the pins are the steps that the board reports.
const POSITIONS: &str = "reported positions are the pulses";
/// Without a configuration no motor moves.
const CONFIGURED: &str = "no motion without a configuration";
/// A board in a fault rests after its ramp.
const FAULT: &str = "a fault stops the motors";
/// A board whose host is silent rests after its deadline and its ramp.
const SILENT: &str = "a silent host stops the motors";
/// The board restarts only where a fault restarts it.
const RESTART: &str = "no restart by itself";

/// Limits of a motor.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Greatest rate, steps/s.
    rate: f64,
    /// Greatest acceleration, steps/s².
    acceleration: f64,
    /// Length of the running mean of the rates, µs.
    mean_us: u64,
}

impl Limits {
    /// Returns the longest time from a stop to standstill, µs.
    fn stop_us(&self) -> u64 {
        (self.rate / self.acceleration * 1e6) as u64 + self.mean_us + SLACK_US
    }
}

/// Checks of one chip.
pub(super) struct Checks {
    limits: Limits,
    /// Deadline for a silent host, µs.
    deadline_us: u64,
    /// Intervals in which a restart is expected.
    restarts: Vec<(Micros, Micros)>,
    /// Positions at the board's start, full steps.
    origin: [f64; 3],
    /// Positions after each of the last ticks, full steps; the newest last.
    positions: VecDeque<[f64; 3]>,
    last_frame: Micros,
    is_configured: bool,
    /// Start of the present fault.
    faulted: Option<(Micros, Fault)>,
    violations: Vec<String>,
}

impl Checks {
    pub(super) fn new(plan: &Plan, motors: [f64; 3]) -> Self {
        let config = plan.rig().config().expect("a rig file that fits the board");
        let motor = config.motors[0];
        let restarts = plan.faults.iter().filter_map(|fault| match fault.kind {
            Kind::Reset => Some((fault.from, Micros(fault.from.0 + SLACK_US))),
            Kind::Crash => Some((fault.from, Micros(fault.from.0 + WATCHDOG_US))),
            _ => None,
        });
        Self {
            limits: Limits {
                rate: motor.max_rate.to_si(),
                acceleration: f64::from(motor.max_acceleration.0),
                mean_us: u64::from(config.mean.0) * 1000,
            },
            deadline_us: u64::from(config.deadlines.host.0) * 1000,
            restarts: restarts.collect(),
            origin: motors,
            positions: VecDeque::from([motors]),
            last_frame: Micros(0),
            is_configured: false,
            faulted: None,
            violations: Vec::new(),
        }
    }

    pub(super) fn violations(&self) -> &[String] {
        &self.violations
    }

    /// Takes in a restart of the board.
    pub(super) fn restarted(&mut self, now: Micros, motors: [f64; 3]) {
        let expected = self.restarts.iter().any(|(from, to)| (*from..=*to).contains(&now));
        self.check(expected, RESTART, now, String::new);
        self.origin = motors;
        self.positions = VecDeque::from([motors]);
        (self.is_configured, self.faulted) = (false, None);
    }

    /// Takes in that a frame went to the board.
    pub(super) fn heard(&mut self, now: Micros) {
        self.last_frame = now;
    }

    /// Takes in telemetry.
    pub(super) fn told(&mut self, now: Micros, telemetry: &Telemetry) {
        self.is_configured |= telemetry.state != State::Unconfigured;
        if telemetry.rates.iter().all(|rate| rate.0 == 0) && self.is_at_rest() {
            let motors = telemetry.motors.map(Steps16::to_si);
            let last = self.last();
            let counted = [0, 1, 2].map(|i| last[i] - self.origin[i]);
            self.check(motors[..] == counted, POSITIONS, now, || {
                format!("{motors:?}, {counted:?}")
            });
        }
    }

    /// Returns whether no motor has moved in the last ticks.
    pub(super) fn is_at_rest(&self) -> bool {
        let last = self.last();
        self.positions.iter().rev().take(WINDOW).all(|positions| *positions == last)
    }

    /// Takes in the motor positions after a tick, and the state of the board.
    pub(super) fn moved(&mut self, now: Micros, motors: [f64; 3], state: State) {
        let moves = motors != self.last();
        self.positions.push_back(motors);
        if self.positions.len() > 2 * WINDOW + 1 {
            self.positions.pop_front();
        }
        self.faulted = match (state, self.faulted) {
            (State::Fault(fault), None) => Some((now, fault)),
            (State::Fault(fault), Some((_, before))) if fault != before => Some((now, fault)),
            (State::Fault(_), same) => same,
            _ => None,
        };
        self.check_rates(now);
        if moves {
            self.check_motion(now);
        }
    }

    /// Checks that motors may move.
    fn check_motion(&mut self, now: Micros) {
        let stop_us = self.limits.stop_us();
        let is_configured = self.is_configured;
        self.check(is_configured, CONFIGURED, now, String::new);
        let silence = now.since(self.last_frame);
        let is_heard = silence <= self.deadline_us + stop_us;
        self.check(is_heard, SILENT, now, || format!("{silence} µs"));
        if let Some((since, fault)) = self.faulted {
            let is_cut = fault == Fault::EmergencyStop;
            let allowed = if is_cut { SLACK_US } else { stop_us };
            self.check(now.since(since) <= allowed, FAULT, now, || format!("{fault:?}"));
        }
    }

    /// Checks rates and accelerations over the last windows, to a pulse at each end.
    fn check_rates(&mut self, now: Micros) {
        let count = self.positions.len();
        let is_cut = self.faulted.is_some_and(|(_, fault)| fault == Fault::EmergencyStop);
        // A hung processor and an open emergency input end the pulses at once.
        let is_hung = self.restarts.iter().any(|(from, to)| (*from..=*to).contains(&now));
        if count < 2 * WINDOW + 1 || is_cut || is_hung {
            return;
        }
        let at = |back: usize| self.positions[count - 1 - back];
        let (new, middle, old) = (at(0), at(WINDOW), at(2 * WINDOW));
        let Limits { rate: most, acceleration, .. } = self.limits;
        for i in 0..3 {
            let rates = [(middle[i] - old[i]) / WINDOW_S, (new[i] - middle[i]) / WINDOW_S];
            let slack = 2.0 * PULSE / WINDOW_S;
            self.check(rates[1].abs() <= most + slack, RATE, now, || format!("{rates:?}"));
            let change = (rates[1] - rates[0]).abs();
            let allowed = acceleration * WINDOW_S + 2.0 * slack;
            self.check(change <= allowed, ACCELERATION, now, || format!("{rates:?} steps/s"));
        }
    }

    fn last(&self) -> [f64; 3] {
        self.positions.back().copied().unwrap_or_default()
    }

    /// Records that `invariant` is broken unless `holds`, once for each invariant.
    fn check(
        &mut self,
        holds: bool,
        invariant: &str,
        now: Micros,
        detail: impl FnOnce() -> String,
    ) {
        if !holds && !self.violations.iter().any(|known| known.contains(invariant)) {
            self.violations.push(format!("{} µs: {invariant}: {}", now.0, detail()));
        }
    }
}

#[cfg(test)]
mod tests;
