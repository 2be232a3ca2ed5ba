//! Co-simulation: a board in lock step with any physics engine. A request gives a time span and the
//! camera's measurement; the answer gives the motor positions.

use plumb_core::TICK_US;
use plumb_emulator::{EMULATED, Harness, LawDelay};
use plumb_path::moving::MovingTarget;
use plumb_path::trajectory::Moment;
use plumb_protocol::config::Workspace;
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Position, Refusal, State};
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{Micros, Point};
use plumb_protocol::{Config, PerAxis, PerMotor, Wiring};
use plumb_runtime::reference::{keep_inside, reference};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Request of a physics engine. Metres in the rig frame, seconds. An unknown key is an error.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Time at the start of the span.
    pub t: f64,
    /// Length of the span; above 0, at most 10.
    pub dt: f64,
    /// Measured position of the ball in a frame that arrives at `t`; `null` without a frame or
    /// without a ball.
    #[serde(default)]
    pub position: Option<PerAxis<f64>>,
    /// Age of that frame.
    #[serde(default)]
    pub age: f64,
    /// New target of the ball; `null` keeps the present one.
    #[serde(default)]
    pub target: Option<PerAxis<f64>>,
    /// Velocity of `target`, m/s: the ball follows a target that moves. Give both in every line
    /// that brings a picture; without a new one the ball comes to rest within a second.
    #[serde(default)]
    pub target_velocity: Option<PerAxis<f64>>,
}

/// Motion and state of the board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// The time at the end, seconds.
    pub t: f64,
    /// Motor positions at even intervals over the span, the last at its end: full steps since the
    /// start, + pays cable out; A, B, C.
    pub steps: Vec<PerMotor<f64>>,
    /// Motor rates at the end, full steps/s.
    pub rates: PerMotor<f64>,
    /// State of the board, for people.
    pub state: String,
    /// Whether the present target has been reached.
    pub reached: bool,
}

/// Reason that a request failed.
#[derive(Debug, Error, PartialEq)]
pub enum CosimError {
    /// A number out of range.
    #[error("`{key}` = {value}: {why}")]
    Number {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Its valid range.
        why: &'static str,
    },
    /// The span does not begin at the end of the last one.
    #[error("`t` = {t}, but the board is at {now} s: each line begins where the last one ended")]
    Gap {
        /// Time of the request.
        t: f64,
        /// Time of the board.
        now: f64,
    },
    /// A velocity without a target.
    #[error("`target_velocity` without `target`: give both, or `target` alone")]
    VelocityAlone,
    /// The board refused a command.
    #[error("{}", refused(.0))]
    Refused(Refusal),
}

/// Returns why the board refuses a command. No request clears a fault.
fn refused(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Faulted(fault) => {
            format!("the board has stopped by itself ({fault}): begin the co-simulation again")
        }
        other => format!("the board refuses: {other}"),
    }
}

/// Longest time between two commands, µs.
const HEARTBEAT_US: u64 = 100_000;
/// Greatest |`t`|, seconds: 30 years, over which `f64` resolves microseconds.
const MAX_TIME_S: f64 = 1e9;
/// Greatest speed of a target along an axis, m/s: the board's limit.
const MAX_SPEED: f64 = 2.0;
/// Tolerance of `t` for rounding in an engine's sum of time steps, seconds.
const TIME_TOLERANCE_S: f64 = 1e-3;

/// A board that runs in steps.
pub struct Cosim {
    harness: Harness,
    /// Clock of the board.
    clock: Micros,
    /// The engine's time at zero of the board's clock, seconds.
    zero_s: Option<f64>,
    /// Time of the last command.
    last_command: Micros,
    sequence: u16,
    target: Option<Point>,
    /// A target that moves.
    moving: MovingTarget,
    /// Number of the last reference.
    reference: u16,
    workspace: Workspace,
    reached: bool,
}

impl Cosim {
    /// Creates a board with this wiring and configuration, and what is known of the rig.
    ///
    /// # Errors
    /// If the board refuses them.
    pub fn new(wiring: Wiring, config: Config, prior: Option<Prior>) -> Result<Self, CosimError> {
        let mut cosim = Self {
            harness: Harness::new(EMULATED, LawDelay::SameTick),
            clock: Micros(0),
            zero_s: None,
            last_command: Micros(0),
            sequence: 0,
            target: None,
            moving: MovingTarget::default(),
            reference: 0,
            workspace: config.workspace,
            reached: false,
        };
        cosim.send(Command::Hello(Hello::OURS))?;
        cosim.send(Command::Wire(wiring))?;
        cosim.send(Command::Configure(config))?;
        if let Some(prior) = prior {
            cosim.send(Command::Prior(prior))?;
        }
        Ok(cosim)
    }

    /// Carries out a request. Returns `samples` (1 or more) motor positions.
    ///
    /// # Errors
    /// If a number is out of range, the time has a gap, or the board refuses the target. Positions
    /// that the board refuses (too old, outside the workspace) are ignored, as on a rig.
    pub fn step(&mut self, request: &Request, samples: u32) -> Result<Answer, CosimError> {
        check("t", request.t, request.t.abs() <= MAX_TIME_S, "-1e9 to 1e9 s")?;
        let zero = *self.zero_s.get_or_insert(request.t);
        let now = zero + self.clock.0 as f64 * 1e-6;
        let tick_s = f64::from(TICK_US) * 1e-6;
        check(
            "dt",
            request.dt,
            (0.0..=10.0).contains(&request.dt) && request.dt > 0.0,
            "above 0, at most 10 s",
        )?;
        let slip = (request.t - now).abs();
        if slip.is_nan() || slip > TIME_TOLERANCE_S + tick_s {
            return Err(CosimError::Gap { t: request.t, now });
        }
        match (request.target, request.target_velocity) {
            (Some(target), None) => self.set_target(target)?,
            (None, Some(_)) => return Err(CosimError::VelocityAlone),
            _ => {}
        }
        if let Some(ball) = request.position {
            self.on_position(ball, request.age)?;
        }
        if let (Some(target), Some(velocity)) = (request.target, request.target_velocity) {
            self.follow(target, velocity)?;
        }
        let mut steps = Vec::new();
        for k in 1..=samples {
            let end = request.t - zero + request.dt * f64::from(k) / f64::from(samples);
            self.run_to(Micros((end.max(0.0) * 1e6).round() as u64))?;
            steps.push(self.harness.motors());
        }
        self.reached |= self.harness.board.state() == State::Holding;
        Ok(Answer {
            t: request.t + request.dt,
            steps,
            rates: self.harness.rates(),
            state: self.harness.board.state().to_string(),
            reached: self.reached,
        })
    }

    /// Sends a new target.
    fn set_target(&mut self, target: PerAxis<f64>) -> Result<(), CosimError> {
        let point = point("target", target)?;
        (self.target, self.reached) = (Some(point), false);
        self.send(Command::Target(point))
    }

    /// Has the ball follow a target that is at `target` (metres) with `velocity` (m/s). A board
    /// that has lost the ball, or has not seen it yet, follows with a later line.
    fn follow(&mut self, target: PerAxis<f64>, velocity: PerAxis<f64>) -> Result<(), CosimError> {
        let _in_range = point("target", target)?;
        for speed in velocity {
            check("target_velocity", speed, speed.abs() <= MAX_SPEED, "within 2 m/s")?;
        }
        (self.target, self.reached) = (None, false);
        let now = self.clock.0 as f64 * 1e-6;
        self.moving.observe(now, target.into(), velocity.into());
        self.reference = self.reference.wrapping_add(1);
        let motion = |time| self.moving.at(time).unwrap_or(Moment::resting(target.into()));
        let mut message = reference(self.reference, false, now, now, motion);
        keep_inside(&mut message, &self.workspace);
        match self.send(Command::Follow(message)) {
            Err(CosimError::Refused(
                Refusal::NoPosition | Refusal::Faulted(Fault::PositionLost),
            )) => Ok(()),
            other => other,
        }
    }

    /// Sends a position. A board that stopped for a lost position gets its target again.
    fn on_position(&mut self, ball: PerAxis<f64>, age: f64) -> Result<(), CosimError> {
        check("age", age, (0.0..=60.0).contains(&age), "0 to 60 s")?;
        if self.harness.board.state() == State::Fault(Fault::PositionLost) {
            let _still_moving = self.send(Command::ClearFault);
        }
        if let (State::Ready, Some(target)) = (self.harness.board.state(), self.target) {
            self.send(Command::Target(target))?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        let position = Position {
            sequence: self.sequence,
            age_us: (age * 1e6).round() as u32,
            ball: Some(point("position", ball)?),
            covariance: None,
        };
        let _lost = self.send(Command::Position(position));
        Ok(())
    }

    /// Runs the board to `end` and keeps the link alive.
    fn run_to(&mut self, end: Micros) -> Result<(), CosimError> {
        while self.clock.0 + u64::from(TICK_US) <= end.0 {
            if self.clock.since(self.last_command) >= HEARTBEAT_US {
                self.send(Command::Status)?;
            }
            let _ = self.harness.tick(self.clock);
            self.harness.outbox.clear();
            self.clock.0 += u64::from(TICK_US);
        }
        Ok(())
    }

    /// Sends a command.
    ///
    /// # Errors
    /// If the board refuses it.
    fn send(&mut self, command: Command) -> Result<(), CosimError> {
        self.last_command = self.clock;
        self.harness.send(self.clock, command);
        let refusal = self.harness.take_messages().into_iter().find_map(|message| match message {
            Ok(FromBoard::Answer(answer)) => answer.refusal,
            _ => None,
        });
        refusal.map_or(Ok(()), |refusal| Err(CosimError::Refused(refusal)))
    }
}

/// Returns an error for `key` unless `holds`.
fn check(key: &'static str, value: f64, holds: bool, why: &'static str) -> Result<(), CosimError> {
    if holds { Ok(()) } else { Err(CosimError::Number { key, value, why }) }
}

/// Converts a point in metres to the wire's units.
fn point(key: &'static str, metres: PerAxis<f64>) -> Result<Point, CosimError> {
    let farthest = metres.into_iter().fold(0.0, |a, b| if b.abs() > f64::abs(a) { b } else { a });
    Point::from_metres(metres).ok_or(CosimError::Number {
        key,
        value: farthest,
        why: "metres, within 2 km",
    })
}

#[cfg(test)]
mod tests;
