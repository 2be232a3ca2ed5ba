//! An operator who sets random targets, and now and then holds, stops or makes a mistake.

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::Point3;
use plumb_emulator::EmulatedBoard;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::{OperatorCommand, OperatorSender};
use plumb_runtime::run::StopReason;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Least and largest number of pictures between two commands, at 30 a second.
const PAUSE: std::ops::Range<u64> = 30..450;

/// Distance at which a target truly is reached, metres: the paper's radius and the camera's error.
const REACHED: f64 = 0.011;

/// Operator of a session. It sees what an observer sees, and the true ball.
pub(super) struct RandomOperator {
    sender: OperatorSender,
    random: ChaCha8Rng,
    board: Rc<RefCell<EmulatedBoard>>,
    /// Number of pictures of the session.
    length: u64,
    /// Picture after which the next command is sent.
    next: u64,
    /// The present target, metres.
    target: Option<Point3<f64>>,
    pub(super) reached: usize,
    pub(super) targets: usize,
    pub(super) frames: u64,
    /// Targets that were reported as reached while the ball was elsewhere.
    pub(super) false_claims: Vec<String>,
}

impl RandomOperator {
    /// Creates the operator of a session of `length` pictures.
    pub(super) fn new(
        sender: OperatorSender,
        random: ChaCha8Rng,
        board: Rc<RefCell<EmulatedBoard>>,
        length: u64,
    ) -> Self {
        Self {
            sender,
            random,
            board,
            length,
            next: PAUSE.start,
            target: None,
            reached: 0,
            targets: 0,
            frames: 0,
            false_claims: Vec::new(),
        }
    }

    /// Returns the distance of the true ball from the present target, metres.
    fn true_error(&self) -> Option<f64> {
        let ball = self.board.borrow().ball()?;
        self.target.map(|target| (ball - target).norm())
    }

    /// Draws a command: mostly a target in the middle of the workspace. A Stop is resumed next.
    fn draw(&mut self) -> OperatorCommand {
        if let Some(stop) = self.sender.stop() {
            // A new source begins anew, in virtual time too.
            self.sender = self.sender.source("the operator");
            return OperatorCommand::Resume { stop: stop.number };
        }
        let random = &mut self.random;
        let inside = Point3::new(
            random.random_range(0.4..0.65),
            random.random_range(0.2..0.4),
            random.random_range(0.15..0.45),
        );
        match random.random_range(0..20) {
            0 => OperatorCommand::Hold,
            1 => OperatorCommand::Stop,
            2 => OperatorCommand::Target(Point3::new(9.0, 0.0, 0.0)),
            3 => OperatorCommand::ClearFault,
            _ => OperatorCommand::Target(inside),
        }
    }
}

impl Observer for RandomOperator {
    fn frame(&mut self, record: &FrameRecord) {
        self.frames += 1;
        let command = if record.number >= self.length {
            OperatorCommand::End
        } else if record.number >= self.next {
            self.next = record.number + self.random.random_range(PAUSE);
            self.draw()
        } else {
            return;
        };
        // A run that has ended takes no commands.
        let _ended = self.sender.send(command);
    }

    fn event(&mut self, record: &EventRecord) {
        match &record.event {
            RunEvent::TargetSet { target, .. } => {
                self.targets += 1;
                self.target = Some(*target);
            }
            RunEvent::TargetEnded { number, reason: StopReason::Reached } => {
                self.reached += 1;
                if let Some(error) = self.true_error().filter(|error| *error > REACHED) {
                    self.false_claims.push(format!("target {number} reached at {error:.4} m"));
                }
            }
            _ => {}
        }
    }
}
