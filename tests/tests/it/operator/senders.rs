//! Senders of everything that moves the ball, at every rate that their limits allow.

use std::time::Instant;

use nalgebra::Point3;
use plumb_runtime::operator::{Continuity, OperatorCommand, OperatorSender};
use plumb_runtime::targets::MotionId;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Kind of a sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Targets to stop at, of a page or of ROS 2.
    Target,
    /// A page's drag that goes on.
    Drag,
    /// A page's drags, each of one message.
    Gestures,
    /// A publisher's targets that move.
    Moving,
    /// Jogs of a motor.
    Jog,
    /// Holds.
    Hold,
    /// Clears faults.
    Clear,
    /// A page that vanishes in a jog again and again.
    Vanishing,
    /// Motions of a caller that does not ask whether a Stop is in force.
    Unasked,
}

impl Kind {
    pub(crate) const ALL: [Self; 9] = [
        Self::Target,
        Self::Drag,
        Self::Gestures,
        Self::Moving,
        Self::Jog,
        Self::Hold,
        Self::Clear,
        Self::Vanishing,
        Self::Unasked,
    ];
}

/// A sender that never minds what becomes of its commands.
#[derive(Debug)]
pub(crate) struct Sender {
    pub(crate) kind: Kind,
    operator: OperatorSender,
    /// Frames from one turn to the next.
    period: u64,
    /// Frame of the first turn.
    phase: u64,
    /// Messages in a turn.
    burst: u32,
    motion: Option<MotionId>,
    random: ChaCha8Rng,
}

impl Sender {
    /// Returns a sender of a random rate: up to 90 messages a second at 30 frames a second, and
    /// less than a second apart.
    pub(crate) fn new(kind: Kind, operator: &OperatorSender, mut random: ChaCha8Rng) -> Self {
        let period = random.random_range(1..=25);
        Self {
            kind,
            operator: operator.source(&format!("{kind:?}")),
            period,
            phase: random.random_range(0..period),
            burst: if period == 1 { random.random_range(1..=3) } else { 1 },
            motion: None,
            random,
        }
    }

    /// Sends what is due after frame `number`.
    pub(crate) fn act(&mut self, number: u64) {
        if number % self.period == self.phase {
            for _ in 0..self.burst {
                self.send();
            }
        }
    }

    fn send(&mut self) {
        let place = self.place();
        let jog = OperatorCommand::Jog { motor: 0, distance: 30.0, rate: 40.0 };
        match self.kind {
            Kind::Target => self.command(OperatorCommand::Target(place)),
            Kind::Jog => self.command(jog),
            Kind::Hold => self.command(OperatorCommand::Hold),
            Kind::Clear => self.command(OperatorCommand::ClearFault),
            Kind::Vanishing => {
                self.command(jog);
                self.command(OperatorCommand::RampDown);
            }
            Kind::Drag | Kind::Gestures | Kind::Moving => self.move_target(place),
            Kind::Unasked => {
                let targets = self.operator.targets();
                targets.send(targets.begin(), Instant::now(), place, None);
            }
        }
    }

    /// Sends a place as a page and ROS 2 do.
    fn move_target(&mut self, place: Point3<f64>) {
        let begins = match self.kind {
            Kind::Gestures => true,
            _ => self.motion.is_none(),
        };
        let is_gesture = self.kind != Kind::Moving;
        let continuity =
            if begins && is_gesture { Continuity::Begins } else { Continuity::MayGoOn };
        if self.operator.admit_target(continuity).is_ok() {
            let targets = self.operator.targets();
            let motion = self.motion.filter(|_| !begins).unwrap_or_else(|| targets.begin());
            self.motion = Some(motion);
            targets.send(motion, Instant::now(), place, None);
        }
    }

    fn command(&self, command: OperatorCommand) {
        // A refusal is what the campaign is about.
        let _refused = self.operator.send(command);
    }

    /// Returns a place in the workspace, m.
    fn place(&mut self) -> Point3<f64> {
        let mut within = |low, high| self.random.random_range(low..high);
        Point3::new(within(0.35, 0.55), within(0.25, 0.40), within(0.20, 0.35))
    }
}
