//! Loop of a node: requests and targets in, positions, answers and diagnostics out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_runtime::operator::{
    CommandOutcome, CommandRefusal, OperatorCommand, OperatorSender, Stop,
};
use rustdds::mio1::{Events, Poll, Token, Waker};

use crate::Ros2Settings;
use crate::action::Action;
use crate::endpoints::Endpoints;
use crate::error::Ros2Error;
use crate::feed::Feed;
use crate::ledger::{Origin, Settled};
use crate::message::diagnostic::{KeyValue, Level};
use crate::service::Ticket;
use crate::status::{Report, stop_report};
use crate::targets::TargetRules;
use crate::topic::MAX_IN_TURN;

/// Time between two diagnostics if nothing happens.
const DIAGNOSTICS: Duration = Duration::from_secs(1);

/// Least time between two diagnostics.
const MIN_DIAGNOSTICS: Duration = Duration::from_millis(100);

/// Longest wait before the node looks whether the program was interrupted.
const LOOK: Duration = Duration::from_millis(50);

/// Time from an attempt to join ROS 2 anew that has failed to the next one.
const RETRY: Duration = Duration::from_secs(1);

/// Token of the run's wake-ups.
const RUN: Token = Token(0);

/// Node of a rig.
pub(crate) struct NodeLoop {
    settings: Ros2Settings,
    poll: Poll,
    endpoints: Endpoints,
    /// Number of times that the node has joined ROS 2.
    joined: u64,
    /// Whether the DDS library has ended, and the node has not joined anew yet.
    is_lost: bool,
    targets: TargetRules,
    feed: Arc<Feed>,
    /// Sender of a Stop for an interruption.
    interruption: OperatorSender,
    /// The Stop that was published as the one that holds, and when; `None` before the first.
    published: Option<(Option<Stop>, Instant)>,
    last_diagnostics: Instant,
    /// Earliest time of the next attempt to join ROS 2 anew.
    next_join: Instant,
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
        let poll = Poll::new().map_err(Ros2Error::Thread)?;
        let endpoints = Endpoints::join(settings, poll.registry())?;
        let targets = TargetRules::new(&settings.namespace, &operator);
        let interruption = operator.source("an interruption of ROS 2");
        let waker = Waker::new(poll.registry(), RUN).map_err(Ros2Error::Thread)?;
        let feed = Arc::new(Feed::new(operator.source("ROS 2"), waker));
        let settings = settings.clone();
        let now = Instant::now();
        Ok(Self {
            settings,
            poll,
            endpoints,
            joined: 1,
            is_lost: false,
            targets,
            feed,
            interruption,
            published: None,
            last_diagnostics: now,
            next_join: now,
        })
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
            let wait = due.saturating_duration_since(now).min(LOOK);
            // An interrupted wait is a wake-up like any other.
            let _interrupted = self.poll.poll(&mut events, Some(wait));
            if self.endpoints.was_interrupted() {
                self.stay_in_ros2();
            }
            self.handle_requests();
            self.publish_stop();
            self.targets.receive(&mut self.endpoints.targets, &self.feed);
            self.handle_outcomes();
            self.targets.send(&mut self.feed.state());
            self.publish_sample();
            if self.feed.state().is_closing {
                self.close();
                return;
            }
            if Instant::now() >= self.diagnostics_due() {
                self.stay_in_ros2();
                self.publish_diagnostics();
            }
        }
    }

    /// Stops the rig once if the DDS library has ended, for a Stop that is sent meanwhile is lost.
    /// Joins ROS 2 anew. Where that fails, a call a second later tries again.
    fn stay_in_ros2(&mut self) {
        if self.endpoints.is_alive() {
            return;
        }
        if !self.is_lost {
            self.is_lost = true;
            self.stop_rig();
            tracing::warn!("an interruption has ended ROS 2, and the rig was stopped");
        }
        let now = Instant::now();
        if now >= self.next_join {
            match Endpoints::join(&self.settings, self.poll.registry()) {
                Ok(endpoints) => self.note_joined(endpoints),
                Err(error) => {
                    self.next_join = now + RETRY;
                    tracing::warn!("cannot join ROS 2 anew: {error}");
                }
            }
        }
    }

    /// Notes that the node has joined ROS 2 anew.
    fn note_joined(&mut self, endpoints: Endpoints) {
        (self.endpoints, self.is_lost, self.published) = (endpoints, false, None);
        self.joined += 1;
        // Who calls after this can know the number.
        self.publish_stop();
        let resume = self.settings.namespace.topic(Action::Resume.name());
        tracing::warn!(
            "the run has joined ROS 2 anew; nothing moves the ball until the service `{resume}` \
             is called"
        );
    }

    /// Stops the rig as a Stop of another node does.
    fn stop_rig(&mut self) {
        self.targets.clear();
        let mut state = self.feed.state();
        state.has_news = true;
        // A run that has ended takes no Stop, and needs none.
        let (stop, origin) = (OperatorCommand::Stop, Origin::Answered);
        let _ended = state.ledger.send_from(&self.interruption, stop, origin);
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
                let Some(ticket) = self.endpoints.services[index].next_request() else { break };
                self.handle_request(index, action, ticket);
            }
        }
    }

    fn handle_request(&mut self, service: usize, action: Action, ticket: Ticket) {
        if matches!(action, Action::Stop | Action::Hold) {
            self.targets.clear();
        }
        let Some(command) = action.command() else {
            let (success, message) = self.resume(ticket.arrival);
            self.publish_stop();
            return self.endpoints.services[service].answer(ticket, success, &message);
        };
        let mut state = self.feed.state();
        state.has_news = true;
        // Before the run the motors stand, and the Stop waits for its beginning.
        let is_early = action == Action::Stop && !state.status.has_begun();
        let request = Origin::Request { service, ticket };
        let origin = if is_early { Origin::Answered } else { request };
        let sent = state.ledger.send(command, origin);
        drop(state);
        // A client that has the answer to its Stop may resume.
        self.publish_stop();
        let service = &self.endpoints.services[service];
        match sent {
            Ok(()) if is_early => {
                service.answer(ticket, true, "stop: the motors stand, and the run begins stopped");
            }
            Ok(()) => {}
            Err(error) => service.answer(ticket, false, &error.to_string()),
        }
    }

    /// Ends the Stop in force for a request that came at `arrival`, if its number had been
    /// published before. Returns the answer: success, also where no Stop is in force, and its text.
    fn resume(&self, arrival: Instant) -> (bool, String) {
        let mut state = self.feed.state();
        state.has_news = true;
        let Some(Stop { number, by, .. }) = state.ledger.stop() else {
            return (true, "the rig is not stopped".to_owned());
        };
        match &self.published {
            Some((Some(known), at)) if known.number == number && *at <= arrival => {
                match state.ledger.resume(number) {
                    Ok(()) => (
                        true,
                        format!("the Stop of command {number} has ended: nothing moves by itself"),
                    ),
                    Err(error) => (false, error.to_string()),
                }
            }
            _ => {
                let text = "was not published before this request: look, and call again";
                (false, format!("the Stop of command {number} by {by} {text}"))
            }
        }
    }

    /// Publishes the Stop in force, or that none does, where that has changed.
    fn publish_stop(&mut self) {
        let stop = self.feed.state().ledger.stop();
        let number = |stop: &Option<Stop>| stop.as_ref().map(|stop| stop.number);
        let is_known =
            self.published.as_ref().is_some_and(|(known, _)| number(known) == number(&stop));
        if !is_known {
            self.endpoints.publishers.publish_stop(stop_report(stop.as_ref()));
            self.published = Some((stop, Instant::now()));
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
                    self.endpoints.services[service].answer(ticket, success, &message);
                }
            }
        }
    }

    /// Publishes the newest sample, if it is new.
    fn publish_sample(&mut self) {
        let sample = self.feed.state().sample.take();
        if let Some(sample) = sample {
            self.endpoints.publishers.publish_sample(&sample);
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
        let stop = state.ledger.stop();
        let (run, commands) = (state.status.run(now), state.status.commands(stop.is_some()));
        let moving = state.moving.report(now);
        drop(state);
        let reports = [
            ("run", run),
            ("commands", commands),
            ("stop", stop_report(stop.as_ref())),
            ("moving target", moving),
            ("graph", self.graph()),
        ];
        self.endpoints.publishers.publish_diagnostics(reports);
    }

    /// Returns the report about the publishers of other nodes.
    fn graph(&self) -> Report {
        let unusable = self.endpoints.targets.unusable();
        // Clients often keep one value of a key.
        let named = |(k, it): (u32, _)| KeyValue::new(&format!("unusable {k}"), it);
        let mut values = vec![KeyValue::new("joined", self.joined)];
        values.extend((1..).zip(&unusable).map(named));
        match unusable.first() {
            Some(first) => Report { level: Level::Warn, message: first.to_string(), values },
            None => {
                Report { level: Level::Ok, message: "no unusable publisher".to_owned(), values }
            }
        }
    }
}
