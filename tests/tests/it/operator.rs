//! An operator steers a run, over an ideal link and over lossy ones, in virtual time.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

mod scenario;
mod senders;
mod stop_campaign;

use nalgebra::Point3;
use plumb_protocol::message::{Fault, Refusal, State};
use plumb_runtime::observer::RunEvent;
use plumb_runtime::operator::{CommandOutcome, CommandRefusal, OperatorCommand};
use plumb_runtime::run::StopReason;

use scenario::{FIRST, IDEAL, SECOND, Scenario, at_frames, run, target};

#[test]
fn a_stop_ramps_down_at_once_and_the_frames_go_on_until_the_end() {
    let commands = [(30, OperatorCommand::Stop), (90, OperatorCommand::End)];
    let (summary, seen) = run(&IDEAL, &mut at_frames(&commands));
    assert_eq!(seen.state(30), State::Seeking);
    assert!(matches!(seen.state(31), State::Stopping | State::Ready), "{}", seen.state(31));
    for number in 70..90 {
        let board = seen.frames[number].board.expect("a report");
        assert_eq!((board.state, board.rates), (State::Ready, [0.0; 3].into()));
    }
    assert_eq!(seen.frames.len(), 91);
    assert!(!summary.reached && summary.at_rest, "{summary:?}");
    assert_eq!((&summary.ending, summary.targets_reached), (&StopReason::Ended, 0));
    assert_eq!((summary.legs.len(), &summary.legs[0].ending), (1, &StopReason::Stopped));
    let accepted = commands.map(|(_, command)| (command, CommandOutcome::Accepted));
    assert_eq!(seen.outcomes(), accepted);
}

#[test]
fn the_ball_is_held_after_the_last_target_and_goes_to_further_ones() {
    let mut rest = None;
    let (summary, seen) = run(&IDEAL, &mut |number, seen| {
        if seen.has_ended(1, &StopReason::Reached) {
            return vec![OperatorCommand::End];
        }
        if rest.is_none() && seen.has_ended(0, &StopReason::Reached) {
            rest = Some(number);
        }
        // The board holds the first target for a while.
        if rest.is_some_and(|rest| number == rest + 50) { vec![target(SECOND)] } else { vec![] }
    });
    let rest = rest.expect("a target that is reached");
    assert!((rest..rest + 50).all(|number| seen.state(number) == State::Holding));
    assert!(summary.reached, "{summary:?}");
    let targets: Vec<[f64; 3]> = summary.legs.iter().map(|leg| leg.target_m).collect();
    assert_eq!(targets, [FIRST, SECOND]);
    assert_eq!((summary.targets_reached, summary.ending), (2, StopReason::Ended));
}

#[test]
fn another_target_replaces_the_present_one() {
    let mut was_sent = false;
    let (summary, seen) = run(&IDEAL, &mut |number, seen| {
        if seen.has_ended(1, &StopReason::Reached) {
            return vec![OperatorCommand::End];
        }
        let is_due = number >= 30 && !std::mem::replace(&mut was_sent, number >= 30);
        if is_due { vec![target(SECOND)] } else { vec![] }
    });
    let endings: Vec<_> = summary.legs.iter().map(|leg| leg.ending.clone()).collect();
    assert_eq!(endings, [StopReason::Replaced, StopReason::Reached]);
    assert!(!summary.reached && !summary.legs[0].reached, "{summary:?}");
    let last = seen.frames.last().and_then(|frame| frame.error());
    assert!(last.is_some_and(|error| error < 0.010), "{last:?}");
}

#[test]
fn a_target_outside_the_workspace_is_refused_and_the_drive_goes_on() {
    let mut sent = 0;
    let (summary, seen) = run(&IDEAL, &mut |number, seen| {
        if seen.has_ended(0, &StopReason::Reached) {
            return vec![OperatorCommand::End];
        }
        sent += u32::from(number == 30);
        let outside = [[0.4, 0.4, -3.0], [f64::NAN, 0.4, 0.15], [0.4, f64::INFINITY, 0.15]];
        if number == 30 { outside.map(target).to_vec() } else { vec![] }
    });
    let refusals: Vec<_> = seen.outcomes().into_iter().map(|(_, outcome)| outcome).collect();
    let axes: Vec<_> = refusals[..3]
        .iter()
        .map(|outcome| match outcome {
            CommandOutcome::Refused(CommandRefusal::TargetOutside(outside)) => outside.axis,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(axes, ['z', 'x', 'y']);
    assert_eq!(refusals[3..], [CommandOutcome::Accepted]);
    assert!(summary.reached && summary.legs.len() == 1, "{summary:?}");
}

#[test]
fn a_hold_keeps_the_ball_where_it_is() {
    let commands = [(40, OperatorCommand::Hold), (200, OperatorCommand::End)];
    let (summary, seen) = run(&IDEAL, &mut at_frames(&commands));
    assert_eq!(summary.legs[0].ending, StopReason::Held);
    assert_eq!(seen.state(200), State::Holding);
    let place = |number: usize| seen.frames[number].position().expect("a ball");
    // The ramp takes 0.6 s.
    assert!((place(200) - place(70)).norm() < 0.02, "{} {}", place(70), place(200));
    assert!((place(200) - seen.frames[200].target.expect("a target")).norm() < 0.02);
    assert!((place(200) - Point3::from(FIRST)).norm() > 0.05, "{}", place(200));
}

#[test]
fn a_hold_in_motion_is_one_command_and_its_place_is_known_at_rest() {
    let commands = [(40, OperatorCommand::Hold), (200, OperatorCommand::End)];
    let (_, seen) = run(&IDEAL, &mut at_frames(&commands));
    let held = (40..200).find(|number| seen.state(*number) == State::Holding).expect("a hold");
    let ramp: Vec<State> = (42..held).map(|number| seen.state(number)).collect();
    assert!(ramp.len() > 10 && ramp.iter().all(|state| *state == State::Stopping), "{ramp:?}");
    let frame = |number: u64| &seen.frames[number as usize];
    let target = frame(held - 1).target.expect("a target");
    assert!((target - Point3::from(FIRST)).norm() < 1e-9, "{target} while the ball comes to rest");
    assert_eq!((frame(held - 1).state, frame(held).state), (None, Some(State::Holding)));
    let off =
        (frame(held).target.expect("a target") - frame(held).position().expect("a ball")).norm();
    assert!(off < 1e-3, "{off}");
}

#[test]
fn a_motor_is_jogged_at_rest_only() {
    let jog = |distance| OperatorCommand::Jog { motor: 1, distance, rate: 20.0 };
    let commands = [
        (30, jog(20.0)),
        (31, OperatorCommand::Stop),
        (55, OperatorCommand::Resume { stop: 2 }),
        (70, jog(20.0)),
        (71, jog(f64::NAN)),
        (71, OperatorCommand::Jog { motor: 3, distance: 20.0, rate: 20.0 }),
        (130, OperatorCommand::End),
    ];
    let (_, seen) = run(&IDEAL, &mut at_frames(&commands));
    let outcomes: Vec<_> = seen.outcomes().into_iter().map(|(_, outcome)| outcome).collect();
    let refused = CommandOutcome::Refused;
    let busy = refused(CommandRefusal::Board(Refusal::Busy(State::Seeking)));
    let range = refused(CommandRefusal::OutOfRange);
    let (no_motor, accepted) = (outcomes[5], CommandOutcome::Accepted);
    assert_eq!(outcomes[..5], [busy, accepted, accepted, accepted, range]);
    assert!(matches!(no_motor, CommandOutcome::Refused(CommandRefusal::Board(_))), "{no_motor:?}");
    let motors = |number: usize| seen.frames[number].board.expect("a report").motors;
    let [before, after] = [motors(70), motors(129)];
    assert_eq!(after, [before[0], before[1] + 20.0, before[2]]);
}

#[test]
fn a_fault_is_cleared_and_the_run_goes_on() {
    let scenario = Scenario { hidden: 30..60, ..IDEAL };
    let lost = StopReason::Fault(Fault::PositionLost.into());
    let mut sent = 0;
    let (summary, seen) = run(&scenario, &mut |number, seen| {
        let step = match sent {
            0 if number == 100 => vec![target(SECOND), OperatorCommand::ClearFault],
            1 if number == 110 => vec![target(SECOND)],
            2 if seen.has_ended(1, &StopReason::Reached) => vec![OperatorCommand::End],
            _ => return vec![],
        };
        sent += 1;
        step
    });
    assert!(seen.has_ended(0, &lost), "{:?}", seen.events);
    assert_eq!(seen.state(99), State::Fault(Fault::PositionLost));
    let faulted = CommandRefusal::Board(Refusal::Faulted(Fault::PositionLost));
    let outcomes = seen.outcomes();
    assert_eq!(outcomes[0], (target(SECOND), CommandOutcome::Refused(faulted)));
    assert!(outcomes[1..].iter().all(|(_, outcome)| *outcome == CommandOutcome::Accepted));
    let endings: Vec<_> = summary.legs.iter().map(|leg| leg.ending.clone()).collect();
    assert_eq!(endings, [lost, StopReason::Reached]);
    assert!(!summary.reached, "{summary:?}");
}

#[test]
fn a_fault_of_a_board_that_holds_is_an_event() {
    let mut reached = None;
    let scenario = Scenario { hidden: 600..2000, ..IDEAL };
    let (_, seen) = run(&scenario, &mut |number, seen| {
        if reached.is_none() && seen.has_ended(0, &StopReason::Reached) {
            reached = Some(number);
        }
        if number == 700 { vec![OperatorCommand::End] } else { vec![] }
    });
    assert!(reached.is_some_and(|reached| reached < 600), "{reached:?}");
    let stopped = RunEvent::BoardStopped { fault: Fault::PositionLost.into() };
    assert_eq!(seen.events.iter().filter(|event| **event == stopped).count(), 1);
}

/// A target comes while the board has stopped by itself. Its sender is gone when the fault is
/// cleared.
#[test]
fn a_target_that_moved_during_a_fault_moves_nothing_after_it() {
    let scenario = Scenario { hidden: 600..640, moving: &[(697, SECOND)], ..IDEAL };
    let commands = [(700, OperatorCommand::ClearFault), (760, OperatorCommand::End)];
    let (_, seen) = run(&scenario, &mut at_frames(&commands));
    assert!(matches!(seen.state(697), State::Fault(_)), "{}", seen.state(697));
    assert_eq!((seen.state(759), seen.targets()), (State::Ready, 1), "{:?}", seen.events);
}

#[test]
fn a_target_that_moved_while_the_ball_was_hidden_moves_nothing_afterwards() {
    let moving: &[_] = &[(70, SECOND), (160, SECOND)];
    let scenario = Scenario { hidden: 60..120, moving, ..IDEAL };
    let resume = OperatorCommand::Resume { stop: 1 };
    let commands = [(20, OperatorCommand::Stop), (50, resume), (240, OperatorCommand::End)];
    let (_, seen) = run(&scenario, &mut at_frames(&commands));
    assert_eq!(seen.state(159), State::Ready);
    // The second one comes while the ball is in view.
    assert_ne!(seen.state(170), State::Ready);
    assert_eq!(seen.targets(), 2, "{:?}", seen.events);
}

#[test]
fn targets_that_move_are_followed_after_a_hold_that_a_stop_ended() {
    let scenario = Scenario { moving: &[(120, SECOND)], ..IDEAL };
    let commands = [
        (40, OperatorCommand::Hold),
        (45, OperatorCommand::Stop),
        (90, OperatorCommand::Resume { stop: 2 }),
        (180, OperatorCommand::End),
    ];
    let (_, seen) = run(&scenario, &mut at_frames(&commands));
    assert_eq!((seen.state(119), seen.targets()), (State::Ready, 2), "{:?}", seen.events);
}

/// The board accepts it, and changes nothing.
#[test]
fn a_fault_that_is_cleared_without_one_ends_nothing() {
    let clear = OperatorCommand::ClearFault;
    let (summary, seen) = run(&IDEAL, &mut at_frames(&[(30, clear), (600, OperatorCommand::End)]));
    assert!(summary.reached && seen.state(600) == State::Holding, "{summary:?}");
    let commands = [(40, OperatorCommand::Hold), (45, clear), (200, OperatorCommand::End)];
    let (_, seen) = run(&IDEAL, &mut at_frames(&commands));
    let place = seen.frames[200].position().expect("a ball");
    assert!(
        (place - seen.frames[200].target.expect("a target")).norm() < 0.02,
        "{:?}",
        seen.events
    );
    let scenario = Scenario { moving: &[(30, SECOND)], ..IDEAL };
    let commands = [(60, clear), (400, OperatorCommand::End)];
    let (_, seen) = run(&scenario, &mut at_frames(&commands));
    let place = seen.frames[400].position().expect("a ball");
    assert!((place - Point3::from(SECOND)).norm() < 0.010, "{place}");
}

/// The board refuses every position, for each one is too old.
#[test]
fn without_an_accepted_position_there_is_no_error() {
    let scenario = Scenario { latency: 2.0, ..IDEAL };
    let (summary, seen) = run(&scenario, &mut at_frames(&[(60, OperatorCommand::End)]));
    assert!(summary.located > 30 && summary.refused_positions > 30, "{summary:?}");
    assert_eq!(summary.filtered_error_mm, None);
    assert!(seen.frames.iter().all(|frame| frame.filtered_error.is_none()));
    let (summary, seen) = run(&IDEAL, &mut at_frames(&[(60, OperatorCommand::End)]));
    assert!(summary.filtered_error_mm.is_some_and(|error| error > 10.0), "{summary:?}");
    assert!(seen.frames[60].filtered_error.is_some());
}

/// The Hold and the end of the time for the target cross on the way.
#[test]
fn a_hold_at_the_end_of_the_time_is_carried_out_or_refused() {
    for at in 24..36 {
        let scenario = Scenario { link: "latency 20 ms", timeout: 1.0, ..IDEAL };
        let commands = [(at, OperatorCommand::Hold), (120, OperatorCommand::End)];
        let (_, seen) = run(&scenario, &mut at_frames(&commands));
        let is_held = seen.outcomes()[0].1 == CommandOutcome::Accepted;
        assert_eq!(seen.state(119) == State::Holding, is_held, "{at}: {:?}", seen.events);
    }
}

#[test]
fn a_target_that_is_not_reached_in_time_is_left_and_the_board_rests() {
    let scenario = Scenario { timeout: 1.0, ..IDEAL };
    let (summary, seen) = run(&scenario, &mut at_frames(&[(100, OperatorCommand::End)]));
    assert_eq!((summary.legs.len(), &summary.legs[0].ending), (1, &StopReason::Timeout));
    assert_eq!((seen.state(100), &summary.ending), (State::Ready, &StopReason::Ended));
    assert!(!summary.reached, "{summary:?}");
}

#[test]
fn an_interruption_ends_the_run_while_the_board_holds() {
    let scenario = Scenario { interrupt_at: 600, ..IDEAL };
    let (summary, seen) = run(&scenario, &mut |_, _| vec![]);
    assert_eq!(seen.state(600), State::Holding);
    assert!(summary.reached && summary.at_rest, "{summary:?}");
    assert_eq!((summary.frames, summary.ending), (601, StopReason::Interrupted));
}

/// Over each link and seed every command is carried out once, in order, and the board stands still
/// from a Stop to the next target.
#[test]
fn commands_arrive_over_lossy_links() {
    for link in ["1 % lost", "10 % lost", "25 % lost", "5 % damaged", "10 % doubled", "poor radio"]
    {
        for seed in 0..10 {
            let commands = [
                (20, target(SECOND)),
                (40, OperatorCommand::Stop),
                (75, OperatorCommand::Resume { stop: 2 }),
                (80, target(FIRST)),
                (86, OperatorCommand::Hold),
                (160, OperatorCommand::Stop),
                (220, OperatorCommand::End),
            ];
            let (summary, seen) = run(&Scenario { link, seed, ..IDEAL }, &mut at_frames(&commands));
            let case = format!("{link}, seed {seed}: {:?}", seen.events);
            let accepted = commands.map(|(_, command)| (command, CommandOutcome::Accepted));
            assert_eq!(seen.outcomes(), accepted, "{case}");
            for number in (70..80).chain(210..220) {
                assert_eq!(seen.state(number), State::Ready, "frame {number}, {case}");
            }
            let endings: Vec<_> = summary.legs.iter().map(|leg| leg.ending.clone()).collect();
            let expected = [StopReason::Replaced, StopReason::Stopped, StopReason::Held];
            assert_eq!(endings, expected, "{case}");
        }
    }
}

#[test]
fn commands_that_wait_at_the_end_are_refused() {
    let commands = [(30, target(SECOND)), (30, OperatorCommand::Hold), (30, OperatorCommand::End)];
    let (_, seen) = run(&IDEAL, &mut at_frames(&commands));
    let replaced = CommandOutcome::Refused(CommandRefusal::Replaced);
    let outcomes: Vec<_> = seen.outcomes().into_iter().map(|(_, outcome)| outcome).collect();
    assert_eq!(outcomes, [replaced, replaced, CommandOutcome::Accepted]);
}
