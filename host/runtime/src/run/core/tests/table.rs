//! Every goal against every kind of input.

use super::*;

/// Goals of the table, in the order of its columns.
const GOALS: [&str; 8] =
    ["idle", "waypoint", "path", "moving", "settling", "held", "jogging", "faulted"];

/// Row of the table: an input, and the goals after it, for each goal before it. A `!` means that
/// the run ends.
type Row = (&'static str, fn(&mut Bench), [&'static str; 8]);

/// Returns the table.
fn table() -> Vec<Row> {
    fn send(command: OperatorCommand, reply: Option<Reply>) -> impl Fn(&mut Bench) {
        move |bench| {
            bench.command(command);
            reply.inspect(|reply| bench.answer(*reply));
        }
    }
    vec![
        (
            "a Stop is sent",
            |b| send(OperatorCommand::Stop, None)(b),
            ["idle", "idle", "idle", "idle", "idle", "idle", "idle", "faulted"],
        ),
        (
            "a Stop is accepted",
            |b| send(OperatorCommand::Stop, Some(Ok(())))(b),
            ["idle", "idle", "idle", "idle", "idle", "idle", "idle", "faulted"],
        ),
        (
            "a Hold is sent",
            |b| send(OperatorCommand::Hold, None)(b),
            ["idle", "waypoint", "waypoint", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Hold is accepted",
            |b| send(OperatorCommand::Hold, Some(Ok(())))(b),
            [
                "settling", "settling", "settling", "settling", "settling", "settling", "settling",
                "settling",
            ],
        ),
        (
            "a Target is sent",
            |b| send(target(), None)(b),
            ["idle", "waypoint", "waypoint", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Target is accepted",
            |b| send(target(), Some(Ok(())))(b),
            [
                "waypoint", "waypoint", "waypoint", "waypoint", "waypoint", "waypoint", "waypoint",
                "waypoint",
            ],
        ),
        (
            "a jog is accepted",
            |b| send(JOG, Some(Ok(())))(b),
            ["jogging", "waypoint", "path", "moving", "jogging", "jogging", "jogging", "faulted"],
        ),
        (
            "the fault is cleared",
            |b| {
                b.view.fault = None;
                send(OperatorCommand::ClearFault, Some(Ok(())))(b);
            },
            ["idle", "waypoint", "path", "moving", "settling", "held", "jogging", "idle"],
        ),
        (
            "the board stops by itself",
            Bench::fault,
            [
                "faulted", "faulted", "faulted", "faulted", "faulted", "faulted", "faulted",
                "faulted",
            ],
        ),
        (
            "the ball arrives",
            Bench::arrive,
            ["idle", "idle", "idle", "moving", "held", "held", "idle", "faulted"],
        ),
        (
            "time passes",
            |b| {
                b.now += 1000.0;
                b.tick();
            },
            ["idle", "idle", "idle", "moving", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a target moves",
            |b| b.moving_target(false),
            ["moving", "moving", "moving", "moving", "settling", "moving", "moving", "faulted"],
        ),
        (
            "a target moves during a Stop",
            |b| b.moving_target(true),
            ["idle", "waypoint", "path", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Resume",
            Bench::resume,
            ["idle", "waypoint", "path", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "End",
            |b| send(OperatorCommand::End, None)(b),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "an interruption",
            |b| b.step(Input::Interrupt),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "no more frames",
            |b| b.step(Input::EndOfFrames),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "a failure",
            |b| b.step(Input::Failed(StopReason::Failed("x".to_owned()))),
            ["idle", "idle", "idle", "idle", "settling", "held", "jogging", "faulted"],
        ),
    ]
}

#[test]
fn every_goal_takes_every_input_as_the_table_has_it() {
    for (name, apply, after) in table() {
        let found = GOALS.map(|goal| {
            let mut bench = Bench::with_goal(goal);
            apply(&mut bench);
            let end = if bench.ending.is_some() { "!" } else { "" };
            format!("{}{end}", bench.core.goal.name())
        });
        assert_eq!(found, after, "{name}");
    }
}
