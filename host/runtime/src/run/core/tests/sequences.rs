//! Random sequences of inputs, and what holds for each.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

/// One input of a random sequence.
#[derive(Debug, Clone, Copy)]
enum Op {
    Target,
    Hold,
    Stop,
    Resume,
    Jog,
    ClearFault,
    Answer(bool),
    Telemetry(u8, bool),
    Picture(bool),
    Arrive,
    Lost,
    Moving,
    Fault,
    Tick,
    Wait,
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let op = prop_oneof![
        1 => Just(Op::Target),
        1 => Just(Op::Hold),
        1 => Just(Op::Stop),
        1 => Just(Op::Resume),
        1 => Just(Op::Jog),
        1 => Just(Op::ClearFault),
        3 => any::<bool>().prop_map(Op::Answer),
        1 => (0..6u8, any::<bool>()).prop_map(|(state, about)| Op::Telemetry(state, about)),
        1 => any::<bool>().prop_map(Op::Picture),
        3 => Just(Op::Arrive),
        1 => Just(Op::Lost),
        1 => Just(Op::Moving),
        1 => Just(Op::Fault),
        1 => Just(Op::Tick),
        1 => Just(Op::Wait),
    ];
    proptest::collection::vec(op, 1..60)
}

/// A random run, and what must hold for it.
struct Trial {
    bench: Bench,
    is_stopped: bool,
    /// Whether a command has ended the list of targets.
    has_left_list: bool,
    /// Whether the board held the ball at the present target, with a picture of it there.
    was_there: bool,
    /// Leg under way.
    leg: Option<usize>,
}

impl Trial {
    fn apply(&mut self, op: Op) {
        let bench = &mut self.bench;
        // The operator's queue refuses what moves the ball while a Stop is in force.
        let moves = matches!(op, Op::Target | Op::Hold | Op::Jog);
        match op {
            _ if moves && self.is_stopped => {}
            Op::Target => drop(bench.command(target())),
            Op::Hold => {
                self.has_left_list = true;
                bench.command(OperatorCommand::Hold);
            }
            Op::Jog => drop(bench.command(JOG)),
            Op::Stop => {
                (self.is_stopped, self.has_left_list) = (true, true);
                bench.command(OperatorCommand::Stop);
            }
            Op::Resume if self.is_stopped => {
                self.is_stopped = false;
                bench.resume();
            }
            Op::Resume => {}
            Op::ClearFault => drop(bench.command(OperatorCommand::ClearFault)),
            Op::Answer(is_accepted) => {
                use plumb_protocol::message::Refusal;
                if is_accepted
                    && bench
                        .core
                        .in_flight
                        .is_some_and(|it| it.command == OperatorCommand::ClearFault)
                {
                    bench.view.fault = None;
                }
                bench.answer(if is_accepted { Ok(()) } else { Err(Refusal::NotStored) });
            }
            Op::Telemetry(state, about) => {
                let states = [
                    State::Ready,
                    State::Seeking,
                    State::Holding,
                    State::Following,
                    State::Jogging,
                    State::Stopping,
                ];
                bench.telemetry(states[usize::from(state)], about);
            }
            Op::Picture(is_near) => {
                let place = if is_near {
                    bench.core.target.unwrap_or_default().into()
                } else {
                    [0.4, 0.3, 0.5]
                };
                bench.picture(place);
            }
            Op::Lost => {
                let error = plumb_frame::source::SourceError::new("lost");
                bench.step(Input::FrameLost(error.into()));
            }
            Op::Moving => bench.moving_target(self.is_stopped),
            Op::Fault => bench.view.fault = Some(Fault::BallOutside.into()),
            Op::Arrive => {
                bench.telemetry(State::Holding, true);
                bench.picture(bench.core.target.unwrap_or_default().into());
                self.apply(Op::Tick);
            }
            Op::Tick => {
                let near = bench.core.picture.as_ref().and_then(Picture::position);
                let near = near.is_some_and(|it| {
                    (it.mean - bench.core.target.unwrap_or_default()).norm() < 0.02
                });
                let holds = |it: &Telemetry| it.state == State::Holding;
                let about = match bench.core.goal.is_moving() {
                    true => bench.view.about_rest(),
                    false => bench.view.about_target(),
                };
                self.was_there |= near && about.is_some_and(holds);
                bench.tick();
            }
            Op::Wait => bench.now += 1.0,
        }
    }

    /// Checks the events and actions since the last call.
    fn check(&mut self) {
        for event in self.bench.events.drain(..) {
            match event {
                RunEvent::TargetSet { number, .. } => {
                    assert_eq!(self.leg.replace(number), None, "two legs at a time");
                    self.was_there = false;
                }
                RunEvent::TargetEnded { number, reason } => {
                    assert_eq!(self.leg.take(), Some(number), "a leg that was not under way");
                    let is_reached = reason == StopReason::Reached;
                    assert!(!is_reached || self.was_there, "reached, but the ball was not there");
                }
                _ => {}
            }
        }
        assert_eq!(self.leg.is_some(), self.bench.core.goal.drive().is_some());
        for action in self.bench.sent.drain(..) {
            let moves = matches!(action, BoardAction::Target(_) | BoardAction::Follow(_));
            assert!(!moves || !self.is_stopped, "a message moves the ball during a Stop");
            let is_of_list = matches!(action, BoardAction::Target(_));
            assert!(!is_of_list || !self.has_left_list, "the list goes on after its end");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_inputs_break_no_rule(ops in ops(), targets in 0..3usize, has_path: bool) {
        let bench = Bench::new(targets, has_path && targets > 0);
        let (is_stopped, has_left_list, was_there) = (false, false, false);
        let mut trial = Trial { bench, is_stopped, has_left_list, was_there, leg: None };
        trial.check();
        let mut outcomes = BTreeMap::<u64, u32>::new();
        let mut count = |events: &[RunEvent]| {
            for event in events {
                if let RunEvent::Command { number, .. } = event {
                    *outcomes.entry(*number).or_default() += 1;
                }
            }
        };
        for op in ops {
            trial.apply(op);
            count(&trial.bench.events);
            trial.check();
            if trial.bench.ending.is_some() {
                break;
            }
        }
        trial.bench.step(Input::Closed(Vec::new()));
        count(&trial.bench.events);
        let submitted = trial.bench.number;
        prop_assert!(outcomes.keys().copied().eq(1..=submitted), "{:?}", outcomes);
        prop_assert!(outcomes.values().all(|count| *count == 1), "{:?}", outcomes);
    }
}
