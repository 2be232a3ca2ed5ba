//! Answers that come late, refused commands, and the place of a target that moved.

use super::*;
use crate::targets::SourceEnd;

#[test]
fn a_refused_command_changes_nothing_but_its_outcome() {
    use plumb_protocol::message::{Fault, Refusal};
    for goal in ["idle", "waypoint", "settling", "held", "jogging", "faulted"] {
        for command in [target(), OperatorCommand::Hold, JOG, OperatorCommand::ClearFault] {
            let mut bench = Bench::with_goal(goal);
            bench.command(command);
            bench.answer(Err(Refusal::Faulted(Fault::BallOutside)));
            assert_eq!(bench.core.goal.name(), goal, "{command}");
            assert!(matches!(
                bench.events.last(),
                Some(RunEvent::Command { outcome: CommandOutcome::Refused(_), .. })
            ));
        }
    }
}

#[test]
fn a_command_without_an_answer_comes_before_the_next_target() {
    for command in [OperatorCommand::Hold, target()] {
        let mut bench = Bench::new(2, false);
        bench.command(command);
        bench.sent.clear();
        bench.arrive();
        assert!(
            !bench.sent.iter().any(|action| matches!(action, BoardAction::Target(_))),
            "{command}"
        );
        assert_eq!(bench.core.goal.name(), "waypoint");
    }
}

#[test]
fn a_target_that_moved_is_reached_where_the_board_holds_the_ball_at_its_rest() {
    let reached = |is_rest: bool| {
        let mut bench = Bench::before(0, false, TargetUse::Goal);
        bench.step(Input::Begin { is_stopped: false });
        bench.moving_target(false);
        let arrivals = Arrivals { end: Some(SourceEnd::Complete), ..Arrivals::default() };
        bench.step(Input::Moving { arrivals, is_stopped: false });
        bench.telemetry(State::Holding, true);
        bench.view.subject.is_rest = is_rest;
        bench.picture(bench.core.target.unwrap_or_default().into());
        bench.tick();
        matches!(bench.ending, Some(Ok(StopReason::Reached)))
    };
    assert_eq!([reached(false), reached(true)], [false, true]);
}

/// Before the board has a position of the ball, the error in its telemetry is 0.
#[test]
fn a_target_with_a_wide_tolerance_is_not_passed_before_the_board_knows_the_ball() {
    let mut bench = Bench::new(1, false);
    bench.core.goal.drive_mut().unwrap().waypoint.tolerance_m = Some(0.05);
    for is_reached in [false, true] {
        bench.telemetry(State::Seeking, true);
        bench.picture(TARGET);
        bench.tick();
        let is_end = |event: &RunEvent| {
            matches!(event, RunEvent::TargetEnded { reason: StopReason::Reached, .. })
        };
        assert_eq!(bench.events.iter().any(is_end), is_reached);
    }
}
