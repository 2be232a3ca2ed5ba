//! Targets from topics: set points, and targets that move.

mod admission;
mod moving;

use std::io;
use std::time::Instant;

use plumb_runtime::operator::{OperatorCommand, OperatorSender};
use rustdds::mio1::{Registry, Token};

use self::admission::Admission;
use self::moving::MovingGate;
use crate::action::Action;
use crate::error::Ros2Error;
use crate::feed::{Feed, FeedState};
use crate::ledger::Origin;
use crate::message::geometry::PointStamped;
use crate::namespace::Namespace;
use crate::network::Member;
use crate::peers::UnusablePublisher;
use crate::qos;
use crate::topic::Topic;
use admission::{Sources, TargetGate};

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

/// Rules for targets. They outlive the topics: they hold when the node joins ROS 2 anew.
pub(crate) struct TargetRules {
    admission: Admission,
    sources: Sources,
    gate: TargetGate,
    /// Publisher of the newest set point.
    publisher: Option<OperatorSender>,
    moving_gate: MovingGate,
    /// Names of the topics of set points and of targets that move.
    names: [String; 2],
}

impl TargetRules {
    /// Returns the rules for the targets of a rig, which go to `operator`.
    pub(crate) fn new(namespace: &Namespace, operator: &OperatorSender) -> Self {
        let resume = namespace.topic(Action::Resume.name());
        Self {
            admission: Admission::new(namespace.frame("rig"), resume),
            sources: Sources::new(operator.clone()),
            gate: TargetGate::default(),
            publisher: None,
            moving_gate: MovingGate::new(operator.targets().clone(), moving_topic(namespace)),
            names: [namespace.topic("target"), moving_topic(namespace)],
        }
    }

    /// Takes the targets that have come. The control loop waits for the state of `feed` after each
    /// picture: it is locked for one message at a time.
    pub(crate) fn receive(&mut self, topics: &mut TargetTopics, feed: &Feed) {
        let TargetTopics { set_points, moving } = topics;
        let Self { admission, sources, gate, publisher, moving_gate, names } = self;
        set_points.receive(|message, origin| {
            let source = sources.of(origin.publisher, &names[0]);
            match admission.admit(&message, origin.sent, &source) {
                Ok(target) => {
                    gate.offer(target);
                    *publisher = Some(source);
                }
                Err(refusal) => {
                    let mut state = feed.state();
                    state.status.note_refusal(refusal.to_string());
                    state.has_news = true;
                }
            }
        });
        moving.receive(|message, origin| {
            let source = sources.of(origin.publisher, &names[1]);
            let (now, was_silent) = (Instant::now(), source.is_silent());
            let place = admission.admit(&message, origin.sent, &source);
            let offer =
                |at| moving_gate.offer(origin.publisher, &message.header, at, was_silent, now);
            let mut state = feed.state();
            match place.and_then(offer) {
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
        if state.ledger.stop().is_some() {
            self.gate.clear();
        }
        let Some(publisher) = &self.publisher else { return };
        let Some(target) = self.gate.next(state.status.present_target(), Instant::now()) else {
            return;
        };
        let command = OperatorCommand::Target(target);
        if let Err(error) = state.ledger.send_from(publisher, command, Origin::Target) {
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
}
