//! Lines of a target that moves, with the tracker behind them.

use nalgebra::{Point3, Vector3};
use plumb_path::tracker::{BRAKE_S, COAST_S, Course, TargetTracker};
use plumb_path::trajectory::Moment;
use plumb_runtime::targets::{Beginning, LineIntake, MAX_AGE_S, TargetLine};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "target_lines",
    input: "lines of JSON, each after a character that tells how long it takes to come",
    run,
    max_length: 2000,
    smoke: 3_000,
    words: &[
        "{\"t\": ",
        "\"target\": [0.4, 0.3, 0.2]",
        "\"velocity\": [0.1, 0, 0]",
        "}\n",
        "0{",
        "9{",
        "1e10",
        "1e300",
        "-1",
        "0.45",
        ", ",
        "\n",
    ],
};

/// Largest speed of the target that is believed, m/s.
const MAX_SPEED: f64 = 0.3;

/// Corners of the workspace, metres.
const WORKSPACE: [[f64; 3]; 2] = [[0.1, 0.1, 0.05], [0.8, 0.5, 0.6]];

/// Distance by which a target may leave the workspace between two places that are tried, 20 ms
/// apart, metres.
const SLACK_M: f64 = MAX_SPEED * 0.02;

/// Times after a place at which the target's course is checked, seconds.
const AHEAD_S: [f64; 7] = [0.0, 0.01, 0.13, 0.35, 0.55, 0.81, 30.0];

/// Takes the lines in, and the places in the workspace as those of the target.
pub fn run(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    check_first_line(&text);
    let (mut intake, mut tracker) = (LineIntake::default(), TargetTracker::new(MAX_SPEED));
    let mut arrival = 0.0;
    for line in text.lines() {
        let first = line.chars().next().unwrap_or('0');
        arrival += f64::from(first.to_digit(36).unwrap_or(1)).powi(2) * 0.005;
        let Ok(Some((line, time))) =
            intake.take(&line[first.len_utf8().min(line.len())..], arrival)
        else {
            continue;
        };
        assert!((0.0..=MAX_AGE_S + 1e-9).contains(&(arrival - time)), "{time} s at {arrival} s");
        if is_within(line.position(), 0.0) {
            take(&mut tracker, time, line.position(), line.velocity());
        }
    }
}

/// Checks that a sender on a socket is ended by its first line, or begins with a target.
fn check_first_line(text: &str) {
    let Some(line) = text.lines().next() else { return };
    let mut intake = LineIntake::new(Beginning::Target);
    let taken = intake.take(line, 0.0);
    assert_eq!(intake.fault().is_none(), TargetLine::parse(line).is_ok(), "{line:?}");
    assert_eq!(taken.is_ok(), intake.fault().is_none(), "{line:?}: {taken:?}");
}

/// Takes in a place. Checks that the newest one counts, and where the target goes from there.
fn take(
    tracker: &mut TargetTracker,
    time: f64,
    position: Point3<f64>,
    velocity: Option<Vector3<f64>>,
) {
    let newest = tracker.last_time();
    let is_newer = newest.is_none_or(|newest| time > newest);
    assert_eq!(tracker.observe(time, position, velocity), is_newer, "{time} s after {newest:?}");
    if is_newer {
        assert_eq!((tracker.last_time(), tracker.last_position()), (Some(time), Some(position)));
    }
    let course = tracker.course(|place| is_within(place, 0.0));
    assert!(course.is_some(), "a target without a course");
    let (Some(course), Some(last)) = (course, tracker.last_time()) else { return };
    AHEAD_S.into_iter().for_each(|ahead| check_course(&course, last, ahead));
}

/// Checks that the target stays in the workspace, is not faster than believed, and rests `ahead`
/// seconds after its last place where that is after its motion.
fn check_course(course: &Course, last: f64, ahead: f64) {
    let moment = course.at(last + ahead);
    assert!(moment.is_some(), "a course that ends");
    let Some(Moment { position, velocity, .. }) = moment else { return };
    assert!(is_within(position, SLACK_M), "{moment:?} {ahead} s ahead");
    let highest = if ahead > COAST_S + BRAKE_S { 0.0 } else { MAX_SPEED * (1.0 + 1e-9) };
    assert!(velocity.norm() <= highest, "{moment:?} {ahead} s ahead");
}

/// Returns whether a place is in the workspace, or outside by `slack` at most, metres.
fn is_within(place: Point3<f64>, slack: f64) -> bool {
    let [min, max] = WORKSPACE;
    (0..3).all(|axis| (min[axis] - slack..=max[axis] + slack).contains(&place[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_in_the_corpus_are_targets() {
        for text in [
            include_str!("../../corpus/target_lines/circle"),
            include_str!("../../corpus/target_lines/velocities"),
        ] {
            let mut intake = LineIntake::default();
            assert!(text.lines().all(|line| intake.take(&line[1..], 0.0).is_ok()), "{text}");
        }
    }
}
