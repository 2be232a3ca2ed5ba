//! The board's own code as a controller, driven through encoded frames.

use nalgebra::Point3;
use plumb_emulator::{EMULATED, Harness, LawDelay};
use plumb_protocol::Wiring;
use plumb_protocol::message::{Command, Fault, Position, State};
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{Micros, Point};
use plumb_protocol::{Config, PerMotor};

use super::simulate::Controller;

/// A board that is driven to a target.
pub(crate) struct BoardController {
    harness: Harness,
    sequence: u16,
    reached: bool,
    resumed: bool,
    /// The target; `None` between two runs.
    target: Option<Point>,
    config: Config,
    prior: Option<Prior>,
}

impl BoardController {
    /// Creates a board with this configuration and `prior`, and sends it `target` (metres, rig
    /// frame).
    pub(crate) fn new(config: Config, prior: Option<Prior>, target: Point3<f64>) -> Self {
        let wiring = Wiring::example().of_motors(config.motors.len());
        let mut controller = Self {
            harness: Harness::configured(EMULATED, LawDelay::SameTick, wiring, config),
            sequence: 0,
            reached: false,
            resumed: false,
            target: Point::from_metres(target.into()),
            config,
            prior,
        };
        controller.send_prior(Micros(0));
        controller.send_target(Micros(0));
        controller
    }

    /// Clears the fault of a lost position once the ball is `visible` again, and sends the target
    /// again to a board that is ready.
    fn resume(&mut self, now: Micros, visible: bool) {
        if self.harness.board.state() == State::Fault(Fault::PositionLost) && visible {
            self.resumed = true;
            self.send(now, Command::ClearFault);
        }
        if self.harness.board.state() == State::Ready {
            self.send_target(now);
        }
    }

    /// Sends the target to a board that is ready, or drives to another one.
    fn send_target(&mut self, now: Micros) {
        if let Some(target) = self.target {
            self.send(now, Command::Target(target));
        }
    }

    /// Sends what is known of the rig.
    fn send_prior(&mut self, now: Micros) {
        if let Some(prior) = self.prior {
            self.send(now, Command::Prior(prior));
        }
    }

    /// Sends a command and discards the answer.
    fn send(&mut self, now: Micros, command: Command) {
        self.harness.send(now, command);
        self.harness.outbox.clear();
    }
}

impl Controller for BoardController {
    fn set_target(&mut self, now: Micros, target: Point3<f64>) {
        self.target = Point::from_metres(target.into());
        self.reached = false;
        self.send_target(now);
    }

    fn end_run(&mut self, now: Micros) {
        self.target = None;
        self.send(now, Command::Stop);
    }

    fn begin_run(&mut self, now: Micros, target: Point3<f64>) {
        self.send(now, Command::Configure(self.config));
        self.send_prior(now);
        self.set_target(now, target);
    }

    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.sequence = self.sequence.wrapping_add(1);
        self.resume(now, ball.is_some());
        let ball = ball.and_then(|ball| Point::from_metres(ball.into()));
        let position = Position { sequence: self.sequence, age_us, ball, covariance: None };
        self.send(now, Command::Position(position));
        // Latched: a board can return from holding to seeking.
        self.reached |= self.harness.board.state() == State::Holding;
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        self.harness.tick(now);
        self.harness.outbox.clear();
        self.harness.motors()
    }

    fn reached(&self) -> bool {
        self.reached
    }

    fn failed(&self) -> bool {
        let lost = State::Fault(Fault::PositionLost);
        let state = self.harness.board.state();
        let is_between_runs = self.target.is_none() && state == State::Stopping;
        !matches!(state, State::Seeking | State::Holding | State::Ready)
            && state != lost
            && !is_between_runs
    }

    fn fault(&self) -> Option<Fault> {
        match self.harness.board.state() {
            State::Fault(fault) => Some(fault),
            _ => None,
        }
    }

    fn resumed(&self) -> bool {
        self.resumed
    }
}
