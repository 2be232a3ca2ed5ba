//! Files of paths, and the trajectories along them.

use plumb_path::check::check;
use plumb_path::file::{Kind, Places, parse};
use plumb_path::trajectory::{Moment, MotionLimits, PathError, Run, Trajectory};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "path_file",
    input: "the text of a file with waypoints or places with times",
    run,
    max_length: 2000,
    smoke: 300,
    words: &[
        "x,y,z\n",
        "t,x,y,z\n",
        "0.4,",
        "0.3\n",
        "1e-7,",
        "1e300,",
        "-100,",
        "inf",
        "nan",
        "#",
        "\n",
        ",",
    ],
};

/// Limits of the trajectories.
const LIMITS: MotionLimits = MotionLimits { speed: 0.05, acceleration: 0.25, jerk: 5.0 };

/// Distance of a path from its corners, metres.
const TOLERANCE: f64 = 0.005;

/// Longest trajectory, seconds: a day.
const LONGEST_SPAN_S: f64 = 86_400.0;

/// Longest trajectory whose moments are checked, seconds.
const LONGEST_S: f64 = 120.0;

/// Number of moments whose derivatives are checked.
const MOMENTS: u32 = 200;

/// Parses the input. What is a path becomes a trajectory, once and as a loop.
pub fn run(input: &[u8]) {
    let Ok(file) = parse(&String::from_utf8_lossy(input)) else { return };
    for run in [Run::Once, Run::Loop] {
        let _refused =
            file.trajectory(&LIMITS, TOLERANCE, run).map(|found| check_trajectory(&found, &file));
    }
}

/// Checks that a trajectory has an end, and that one along waypoints keeps its limits.
fn check_trajectory(trajectory: &Trajectory, file: &Places) {
    let span = trajectory.span();
    assert!((0.0..=LONGEST_SPAN_S).contains(&span), "{span} s");
    if span > LONGEST_S {
        return;
    }
    let checked = check(trajectory, &LIMITS, |_| Ok::<(), PathError>(()));
    if file.kind == Kind::Timed {
        // With times of its own a path may be too fast, which the check tells.
        let accepted = checked.is_ok();
        assert!(!accepted || moments(span).all(|time| is_finite(&trajectory.at(time))));
        return;
    }
    assert!(checked.is_ok(), "{checked:?}");
    for time in moments(span) {
        check_derivatives(trajectory, time);
    }
}

/// Returns times that are even over a span, seconds.
fn moments(span: f64) -> impl Iterator<Item = f64> {
    (0..=MOMENTS).map(move |number| span * f64::from(number) / f64::from(MOMENTS))
}

/// Checks that position, velocity and acceleration are continuous at `time`, seconds.
fn check_derivatives(trajectory: &Trajectory, time: f64) {
    let step = 0.002;
    let [from, to] = [time, time + step].map(|time| trajectory.at(time));
    assert!(is_finite(&from) && is_finite(&to), "{from:?} {to:?}");
    let jerk = (to.acceleration - from.acceleration).norm() / step;
    assert!(jerk <= LIMITS.jerk * 1.05, "a jerk of {jerk} m/s³ at {time} s");
    let velocity = (to.position - from.position) / step;
    let off = (velocity - (from.velocity + to.velocity) / 2.0).norm();
    assert!(off <= LIMITS.jerk * step * step, "a velocity that is {off} m/s off at {time} s");
}

fn is_finite(moment: &Moment) -> bool {
    let Moment { position, velocity, acceleration } = moment;
    let numbers = position.iter().chain(velocity.iter()).chain(acceleration.iter());
    numbers.copied().all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_in_the_corpus_are_paths() {
        for (text, runs) in [
            (include_str!("../../corpus/path_file/waypoints"), &[Run::Once, Run::Loop][..]),
            (include_str!("../../corpus/path_file/dense"), &[Run::Once, Run::Loop]),
            (include_str!("../../corpus/path_file/timed"), &[Run::Once, Run::Loop]),
        ] {
            let file = parse(text).unwrap();
            for run in runs {
                assert!(file.trajectory(&LIMITS, TOLERANCE, *run).is_ok(), "{text}");
            }
        }
    }
}
