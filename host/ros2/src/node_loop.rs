//! Loop of a node: requests and targets in, positions, answers and diagnostics out.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_runtime::operator::{CommandOutcome, CommandRefusal, OperatorSender};
use rustdds::mio1::{Events, Poll, Token, Waker};

use crate::Ros2Settings;
use crate::action::Action;
use crate::error::Ros2Error;
use crate::feed::Feed;
use crate::ledger::{Origin, Settled};
use crate::member::Member;
use crate::message::diagnostic::{KeyValue, Level};
use crate::publishers::Publishers;
use crate::service::{Service, Ticket};
use crate::status::Report;
use crate::targets::TargetInputs;
use crate::topic::MAX_IN_TURN;

/// Time between two diagnostics if nothing happens.
const DIAGNOSTICS: Duration = Duration::from_secs(1);

/// Least time between two diagnostics.
const MIN_DIAGNOSTICS: Duration = Duration::from_millis(100);

/// Token of the run's wake-ups.
const RUN: Token = Token(0);
/// Tokens of set points and of targets that move.
const TARGETS: [Token; 2] = [Token(1), Token(2)];
/// Token of the first service.
const FIRST_SERVICE: usize = 3;

/// Node of a rig.
pub(crate) struct NodeLoop {
    poll: Poll,
    targets: TargetInputs,
    /// Services in the order of [`Action::ALL`].
    services: Vec<Service>,
    publishers: Publishers,
    feed: Arc<Feed>,
    last_diagnostics: Instant,
    /// Keeps the topics alive.
    _member: Member,
}

impl NodeLoop {
    /// Joins ROS 2 with a node that sends its commands to `operator`.
    ///
    /// # Errors
    /// As [`Network`](crate::Network) says, and where the operating system refuses.
    pub(crate) fn new(
        settings: &Ros2Settings,
        operator: OperatorSender,
    ) -> Result<Self, Ros2Error> {
        let Ros2Settings { namespace, network, camera } = settings;
        let mut member = network.join(namespace, "plumb")?;
        let publishers = Publishers::new(&mut member, namespace, *camera)?;
        let mut targets = TargetInputs::new(&mut member, namespace, operator.targets().clone())?;
        let names = Action::ALL.map(|action| namespace.topic(action.name()));
        let services = names.iter().map(|name| Service::new(&mut member, name));
        let mut services: Vec<Service> = services.collect::<Result<_, _>>()?;
        let poll = Poll::new().map_err(Ros2Error::Thread)?;
        register(&poll, &mut targets, &mut services).map_err(Ros2Error::Thread)?;
        let waker = Waker::new(poll.registry(), RUN).map_err(Ros2Error::Thread)?;
        let feed = Arc::new(Feed::new(operator, waker));
        let (last_diagnostics, _member) = (Instant::now(), member);
        Ok(Self { poll, targets, services, publishers, feed, last_diagnostics, _member })
    }

    /// Returns the memory between the run and the node.
    pub(crate) fn feed(&self) -> Arc<Feed> {
        Arc::clone(&self.feed)
    }

    /// Handles messages until the feed is closed.
    pub(crate) fn run(mut self) {
        let mut events = Events::with_capacity(64);
        loop {
            let now = Instant::now();
            let due = self.diagnostics_due();
            let due = self.targets.due().map_or(due, |target| target.min(due));
            // An interrupted wait is a wake-up like any other.
            let _interrupted =
                self.poll.poll(&mut events, Some(due.saturating_duration_since(now)));
            self.handle_requests();
            self.targets.receive(&self.feed);
            self.handle_outcomes();
            self.targets.send(&mut self.feed.state());
            self.publish_sample();
            if self.feed.state().is_closing {
                self.close();
                return;
            }
            if Instant::now() >= self.diagnostics_due() {
                self.publish_diagnostics();
            }
        }
    }

    /// Answers the requests that no run has answered, and publishes the last diagnostics.
    fn close(&mut self) {
        self.feed.state().ledger.settle_all(CommandOutcome::Refused(CommandRefusal::RunEnded));
        self.handle_outcomes();
        self.publish_diagnostics();
    }

    /// Takes the requests of all services.
    fn handle_requests(&mut self) {
        for (index, action) in Action::ALL.into_iter().enumerate() {
            for _ in 0..MAX_IN_TURN {
                let Some(ticket) = self.services[index].next_request() else { break };
                self.handle_request(index, action, ticket);
            }
        }
    }

    fn handle_request(&mut self, service: usize, action: Action, ticket: Ticket) {
        let mut state = self.feed.state();
        match action {
            Action::Stop => {
                self.targets.clear();
                state.status.set_stopped(true);
            }
            Action::Resume => {
                self.targets.resume();
                state.status.set_stopped(false);
            }
            Action::Hold => self.targets.clear(),
            Action::ClearFault => {}
        }
        state.has_news = true;
        // Before the run the motors stand, and the Stop waits for its beginning.
        let is_early = action == Action::Stop && !state.status.has_begun();
        let request = Origin::Request { service, ticket };
        let origin = if is_early { Origin::Answered } else { request };
        let sent = action.command().map(|command| state.ledger.send(command, origin));
        drop(state);
        let service = &self.services[service];
        match sent {
            Some(Ok(())) if is_early => {
                service.answer(ticket, true, "stop: the motors stand, and the run begins stopped");
            }
            Some(Ok(())) => {}
            Some(Err(error)) => service.answer(ticket, false, &error.to_string()),
            None => service.answer(ticket, true, "targets are accepted"),
        }
    }

    /// Answers the requests whose outcome is known.
    fn handle_outcomes(&mut self) {
        let settled = self.feed.state().ledger.take_settled();
        for Settled { origin, command, outcome } in settled {
            match origin {
                Origin::Target => self.targets.answered(),
                Origin::Answered => {}
                Origin::Request { service, ticket } => {
                    let (success, message) = match outcome {
                        CommandOutcome::Accepted => (true, format!("{command}: accepted")),
                        CommandOutcome::Refused(refusal) => {
                            (false, format!("{command}: {refusal}"))
                        }
                    };
                    self.services[service].answer(ticket, success, &message);
                }
            }
        }
    }

    /// Publishes the newest sample, if it is new.
    fn publish_sample(&mut self) {
        let sample = self.feed.state().sample.take();
        if let Some(sample) = sample {
            self.publishers.publish_sample(&sample);
        }
    }

    /// Returns the time of the next diagnostics.
    fn diagnostics_due(&self) -> Instant {
        let pause = if self.feed.state().has_news { MIN_DIAGNOSTICS } else { DIAGNOSTICS };
        self.last_diagnostics + pause
    }

    fn publish_diagnostics(&mut self) {
        let now = Instant::now();
        self.last_diagnostics = now;
        let mut state = self.feed.state();
        state.has_news = false;
        let (run, commands) = (state.status.run(now), state.status.commands());
        let moving = state.moving.report(now);
        drop(state);
        let reports = [
            ("run", run),
            ("commands", commands),
            ("moving target", moving),
            ("graph", self.graph()),
        ];
        self.publishers.publish_diagnostics(reports);
    }

    /// Returns the report about the publishers of other nodes.
    fn graph(&self) -> Report {
        let unusable = self.targets.unusable();
        // Clients often keep one value of a key.
        let named = |(k, it): (u32, _)| KeyValue::new(&format!("unusable {k}"), it);
        let values = (1..).zip(&unusable).map(named).collect();
        match unusable.first() {
            Some(first) => Report { level: Level::Warn, message: first.to_string(), values },
            None => {
                Report { level: Level::Ok, message: "no unusable publisher".to_owned(), values }
            }
        }
    }
}

/// Registers everything that wakes the thread.
fn register(poll: &Poll, targets: &mut TargetInputs, services: &mut [Service]) -> io::Result<()> {
    targets.register(poll.registry(), TARGETS)?;
    for (index, service) in services.iter_mut().enumerate() {
        service.register(poll.registry(), Token(FIRST_SERVICE + index))?;
    }
    Ok(())
}
