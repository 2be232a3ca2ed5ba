//! Targets from topics: set points, and targets that move.

mod admission;
mod gate;
mod moving;
mod status;

use std::io;
use std::time::Instant;

use plumb_runtime::operator::OperatorCommand;
use plumb_runtime::targets::TargetSender;
use rustdds::mio1::{Registry, Token};

use self::admission::Admission;
use self::gate::TargetGate;
use self::moving::MovingGate;
pub(crate) use self::status::MovingStatus;
use crate::action::Action;
use crate::error::Ros2Error;
use crate::feed::{Feed, FeedState};
use crate::ledger::Origin;
use crate::member::Member;
use crate::message::geometry::PointStamped;
use crate::namespace::Namespace;
use crate::peers::UnusablePublisher;
use crate::qos;
use crate::topic::Topic;

/// Topics of targets.
pub(crate) struct TargetTopics {
    set_points: Topic<PointStamped>,
    moving: Topic<PointStamped>,
}

impl TargetTopics {
    /// Subscribes to the topics of a rig.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where that is not possible.
    pub(crate) fn new(member: &mut Member, namespace: &Namespace) -> Result<Self, Ros2Error> {
        let set_points = Topic::new(member, &namespace.topic("target"), &qos::NEWEST_MESSAGE)?;
        let moving = Topic::new(member, &moving_topic(namespace), &qos::MOVING_TARGETS)?;
        Ok(Self { set_points, moving })
    }

    /// Wakes the poll of `registry` for each target.
    ///
    /// # Errors
    /// Where the operating system refuses.
    pub(crate) fn register(&mut self, registry: &Registry, tokens: [Token; 2]) -> io::Result<()> {
        self.set_points.register(registry, tokens[0])?;
        self.moving.register(registry, tokens[1])
    }

    /// Returns the publishers on the topics that cannot be used.
    pub(crate) fn unusable(&self) -> Vec<UnusablePublisher> {
        [self.set_points.peers.unusable(), self.moving.peers.unusable()].concat()
    }
}

/// Returns the name of the topic of targets that move.
fn moving_topic(namespace: &Namespace) -> String {
    namespace.topic("moving_target")
}

/// Rules for targets. They outlive the topics: a stop holds when the node joins ROS 2 anew.
pub(crate) struct TargetRules {
    admission: Admission,
    gate: TargetGate,
    moving_gate: MovingGate,
}

impl TargetRules {
    /// Returns the rules for the targets of a rig. Targets that move go to `targets`.
    pub(crate) fn new(namespace: &Namespace, targets: TargetSender) -> Self {
        let resume = namespace.topic(Action::Resume.name());
        Self {
            admission: Admission::new(namespace.frame("rig"), resume.clone()),
            gate: TargetGate::default(),
            moving_gate: MovingGate::new(targets, moving_topic(namespace), resume),
        }
    }

    /// Takes the targets that have come. The control loop waits for the state of `feed` after each
    /// picture: it is locked for one message at a time.
    pub(crate) fn receive(&mut self, topics: &mut TargetTopics, feed: &Feed) {
        let TargetTopics { set_points, moving } = topics;
        let Self { admission, gate, moving_gate } = self;
        set_points.receive(|message, origin| {
            let mut state = feed.state();
            match admission.admit(&message, origin.sent, state.ledger.is_stopped()) {
                Ok(target) => gate.offer(target),
                Err(refusal) => {
                    state.status.note_refusal(refusal.to_string());
                    state.has_news = true;
                }
            }
        });
        moving.receive(|message, origin| {
            let (now, mut state) = (Instant::now(), feed.state());
            let place = admission.admit(&message, origin.sent, state.ledger.is_stopped());
            let publisher = origin.publisher;
            match place.and_then(|at| moving_gate.offer(publisher, &message.header, at, now)) {
                Ok(()) => state.moving.note_taken(now),
                Err(refusal) => {
                    let is_news = state.moving.note_refusal(refusal.to_string(), now);
                    state.has_news |= is_news;
                }
            }
        });
    }

    /// Sends the set point that waits, if it is its turn.
    pub(crate) fn send(&mut self, state: &mut FeedState) {
        if state.ledger.is_stopped() {
            self.gate.clear();
        }
        let Some(target) = self.gate.next(state.status.present_target(), Instant::now()) else {
            return;
        };
        let command = OperatorCommand::Target(target);
        if let Err(error) = state.ledger.send(command, Origin::Target) {
            state.status.note_refusal(format!("{command}: {error}"));
            self.gate.answered();
        }
    }

    /// Returns the time at which the set point that waits may be sent.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.gate.due()
    }

    /// Notes that the set point that was sent has its answer.
    pub(crate) fn answered(&mut self) {
        self.gate.answered();
    }

    /// Drops the set point that waits.
    pub(crate) fn clear(&mut self) {
        self.gate.clear();
    }

    /// Notes a Resume. Targets that were sent before it stay refused.
    pub(crate) fn resume(&mut self) {
        self.admission.resume(Instant::now());
        self.moving_gate.resume();
    }
}
