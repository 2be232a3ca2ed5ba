//! Properties of trajectories: limits, corners, seams, ends, and their interpolation.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use nalgebra::{Point3, Vector3};
use plumb_path::check::{Rule, check};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{Moment, MotionLimits, PathError, Run, Sample, Trajectory, Waypoints};
use proptest::prelude::*;

/// Time between the knots of a path on its way to a board, seconds.
const KNOTS_S: f64 = 0.15;

/// Every motion is allowed.
fn anywhere(_: &Moment) -> Result<(), PathError> {
    Ok(())
}

/// Returns moments every `step` seconds until the trajectory holds nothing new.
fn moments(trajectory: &Trajectory, step: f64) -> Vec<Moment> {
    let count = (trajectory.span() / step).ceil() as usize;
    (0..=count).map(|i| trajectory.at(step * i as f64)).collect()
}

/// Checks the limits, with the jerk from differences of the acceleration, and that each derivative
/// is that of the one before.
fn assert_within(trajectory: &Trajectory, limits: &MotionLimits) {
    check(trajectory, limits, anywhere).unwrap();
    let step = 0.002;
    for pair in moments(trajectory, step).windows(2) {
        let jerk = (pair[1].acceleration - pair[0].acceleration).norm() / step;
        assert!(jerk <= limits.jerk * 1.02, "jerk {jerk}");
        let velocity = (pair[1].position - pair[0].position) / step;
        let mean = (pair[1].velocity + pair[0].velocity) / 2.0;
        assert!((velocity - mean).norm() <= limits.jerk * step * step / 4.0 + 1e-7);
        let acceleration = (pair[1].velocity - pair[0].velocity) / step;
        let mean = (pair[1].acceleration + pair[0].acceleration) / 2.0;
        assert!((acceleration - mean).norm() <= limits.jerk * step, "{acceleration} {mean}");
    }
}

fn assert_rests(trajectory: &Trajectory, time: f64, place: Point3<f64>) {
    let moment = trajectory.at(time);
    assert!((moment.position - place).norm() < 1e-8, "{moment:?}");
    assert!(moment.velocity.norm() < 1e-8, "{moment:?}");
    assert!(moment.acceleration.norm() < 1e-6, "{moment:?}");
}

/// Returns the largest distance of the trajectory from the cubic Hermite polynomials between its
/// moments every 0.15 s.
fn hermite_error(trajectory: &Trajectory) -> f64 {
    let knots = moments(trajectory, KNOTS_S);
    let mut largest = 0.0_f64;
    for (i, pair) in knots.windows(2).enumerate() {
        let [p, q] = [pair[0].position.coords, pair[1].position.coords];
        let [v, w] = [pair[0].velocity * KNOTS_S, pair[1].velocity * KNOTS_S];
        for j in 1..10 {
            let u = f64::from(j) / 10.0;
            let (a, b) = (u * u * (3.0 - 2.0 * u), u * (1.0 - u));
            let place = p * (1.0 - a) + q * a + v * (b * (1.0 - u)) - w * (b * u);
            let truth = trajectory.at(KNOTS_S * (i as f64 + u)).position.coords;
            largest = largest.max((place - truth).norm());
        }
    }
    largest
}

fn distance_to_segment(place: Point3<f64>, from: Point3<f64>, to: Point3<f64>) -> f64 {
    let side: Vector3<f64> = to - from;
    let share = ((place - from).dot(&side) / side.norm_squared()).clamp(0.0, 1.0);
    (place - (from + side * share)).norm()
}

fn places(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Point3<f64>>> {
    let place = prop::array::uniform3(-0.3..0.3).prop_map(Point3::from);
    prop::collection::vec(place, count).prop_filter("two waypoints in one place", |places| {
        let far = |pair: &[Point3<f64>]| (pair[1] - pair[0]).norm() > 0.002;
        places.windows(2).all(far) && (places[0] - places[places.len() - 1]).norm() > 0.002
    })
}

fn limits() -> impl Strategy<Value = MotionLimits> {
    (0.01..0.3, 0.05..1.0, 1.0..20.0).prop_map(|(speed, acceleration, jerk)| MotionLimits {
        speed,
        acceleration,
        jerk,
    })
}

fn kinds() -> impl Strategy<Value = ShapeKind> {
    use ShapeKind::{Circle, Eight, Line, Spline, Square};
    prop::sample::select(vec![Circle, Line, Eight, Square, Spline])
}

fn runs() -> impl Strategy<Value = Run> {
    prop::sample::select(vec![Run::Once, Run::Loop])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn limits_and_tolerance_hold_along_waypoints(
        places in places(2..7),
        tolerance in prop_oneof![Just(0.0), 0.0005..0.02],
        limits in limits(),
        run in runs(),
    ) {
        let waypoints = Waypoints { places: places.clone(), speeds: Vec::new(), tolerance };
        let trajectory = Trajectory::through(&waypoints, &limits, run).unwrap();
        assert_within(&trajectory, &limits);
        let mut corners = places.clone();
        if run == Run::Loop {
            corners.push(places[0]);
        } else {
            assert_rests(&trajectory, -1.0, places[0]);
            assert_rests(&trajectory, trajectory.duration(), places[places.len() - 1]);
        }
        let moments = moments(&trajectory, 0.01);
        for moment in &moments {
            let sides = corners.windows(2);
            let distances = sides.map(|it| distance_to_segment(moment.position, it[0], it[1]));
            let off = distances.fold(f64::INFINITY, f64::min);
            prop_assert!(off <= tolerance + 1e-8, "{} from the sides", off);
        }
        for corner in corners {
            let distances = moments.iter().map(|moment| (moment.position - corner).norm());
            let nearest = distances.fold(f64::INFINITY, f64::min);
            // Two moments are at most a step at full speed apart.
            prop_assert!(nearest <= tolerance + 0.005 * limits.speed + 1e-8, "{}", nearest);
        }
    }

    #[test]
    fn limits_hold_along_shapes(
        kind in kinds(),
        size in 0.02..0.6,
        upright in any::<bool>(),
        limits in limits(),
        run in runs(),
        seed in any::<u64>(),
    ) {
        let plane = if upright { Plane::Upright } else { Plane::Level };
        let centre = Point3::new(0.5, 0.3, 0.3);
        let shape = Shape { kind, centre, size, plane, tolerance: 0.005, seed };
        let trajectory = shape.trajectory(&limits, run).unwrap();
        assert_within(&trajectory, &limits);
        for moment in moments(&trajectory, 0.05) {
            prop_assert!((moment.position - centre).amax() <= 0.55 * size);
        }
    }

    #[test]
    fn the_seam_of_a_loop_is_smooth_and_the_laps_are_alike(
        kind in kinds(),
        limits in limits(),
        size in 0.05..0.4,
    ) {
        let centre = Point3::new(0.5, 0.3, 0.3);
        let shape =
            Shape { kind, centre, size, plane: Plane::Level, tolerance: 0.005, seed: 1 };
        let trajectory = shape.trajectory(&limits, Run::Loop).unwrap();
        prop_assert_eq!(trajectory.duration(), f64::INFINITY);
        assert_rests(&trajectory, 0.0, trajectory.at(-1.0).position);
        let (period, span) = (trajectory.period().unwrap(), trajectory.span());
        for i in 0..=100 {
            let time = span - period + period * f64::from(i) / 100.0;
            let (a, b) = (trajectory.at(time), trajectory.at(time + 7.0 * period));
            prop_assert!((a.position - b.position).norm() < 1e-8);
            prop_assert!((a.velocity - b.velocity).norm() < 1e-7);
            prop_assert!((a.acceleration - b.acceleration).norm() < 1e-6);
        }
    }

    #[test]
    fn samples_are_interpolated_smoothly(places in places(5..9), step in 0.2..2.0_f64) {
        let timed = |places: &[Point3<f64>]| -> Vec<Sample> {
            let sample = |(i, &position)| Sample { time: 3.0 + step * i as f64, position };
            places.iter().enumerate().map(sample).collect()
        };
        let samples = timed(&places);
        let once = Trajectory::through_samples(&samples, Run::Once).unwrap();
        assert_rests(&once, -1.0, places[0]);
        assert_rests(&once, once.duration(), places[places.len() - 1]);
        for (sample, place) in samples.iter().zip(&places) {
            prop_assert!((once.at(sample.time - 3.0).position - place).norm() < 1e-9);
        }
        let moments_of_once = moments(&once, 1e-3);
        let steps = moments_of_once.windows(2).map(|it| (it[1].position - it[0].position).norm());
        let chords: f64 = steps.sum();
        prop_assert!((once.length() / chords - 1.0).abs() < 1e-4, "{} {}", once.length(), chords);
        let mut closed = places.clone();
        closed.push(places[0]);
        let round = Trajectory::through_samples(&timed(&closed), Run::Loop).unwrap();
        assert_rests(&round, 0.0, places[0]);
        for trajectory in [once, round] {
            for pair in moments(&trajectory, 1e-4).windows(2) {
                let jump = (pair[1].acceleration - pair[0].acceleration).norm();
                prop_assert!(jump < 1e-4 * 60.0 * 10.0 / step.powi(3), "{}", jump);
            }
        }
    }
}

#[test]
fn knots_every_150_ms_are_enough_for_a_tenth_of_a_millimetre() {
    let centre = Point3::new(0.5, 0.3, 0.3);
    use ShapeKind::{Circle, Eight, Line, Spline, Square};
    for kind in [Circle, Eight, Line, Spline, Square] {
        for speed in [0.02, 0.05, 0.1, 0.2] {
            for run in [Run::Once, Run::Loop] {
                let plane = Plane::Level;
                let shape = Shape { kind, centre, size: 0.2, plane, tolerance: 0.005, seed: 3 };
                let trajectory = shape.trajectory(&MotionLimits::with_speed(speed), run).unwrap();
                let error = hermite_error(&trajectory);
                assert!(error < 1e-4, "{kind:?} {speed}: {error}");
            }
        }
    }
}

#[test]
fn a_corner_is_passed_in_motion_and_a_straight_line_at_full_speed() {
    let corners = [[0.3, 0.2, 0.3], [0.6, 0.2, 0.3], [0.6, 0.5, 0.3]].map(Point3::from);
    let waypoints = Waypoints { places: corners.to_vec(), speeds: Vec::new(), tolerance: 0.005 };
    let limits = MotionLimits::with_speed(0.05);
    let trajectory = Trajectory::through(&waypoints, &limits, Run::Once).unwrap();
    let moments = moments(&trajectory, 0.01);
    let speeds = || moments.iter().map(|moment| moment.velocity.norm());
    let fastest = speeds().fold(0.0, f64::max);
    assert!((fastest - 0.05).abs() < 1e-9, "{fastest}");
    let moving = &moments[100..moments.len() - 100];
    let slowest = moving.iter().map(|it| it.velocity.norm()).fold(f64::INFINITY, f64::min);
    assert!((0.02..0.05).contains(&slowest), "{slowest}");
}

/// Speed of each leg: the ball keeps them on the straight lines, and the lower one in a corner. On
/// one line the change of speed is no corner that is left out.
#[test]
fn each_leg_keeps_a_speed_of_its_own() {
    let bent = [[0.2, 0.2], [0.4, 0.2], [0.4, 0.4], [0.6, 0.4]];
    let straight = [[0.2, 0.2], [0.4, 0.2], [0.6, 0.2], [0.8, 0.2]];
    let limits = MotionLimits::with_speed(0.08);
    for path in [bent, straight] {
        let places: Vec<_> = path.iter().map(|[x, y]| Point3::new(*x, *y, 0.3)).collect();
        let speeds = vec![0.05, 0.02, f64::INFINITY];
        let waypoints = Waypoints { places: places.clone(), speeds, tolerance: 0.005 };
        for run in [Run::Once, Run::Loop] {
            let trajectory = Trajectory::through(&waypoints, &limits, run).unwrap();
            assert_within(&trajectory, &limits);
            let mut fastest = [0.0_f64; 3];
            for moment in moments(&trajectory, 0.01) {
                for (leg, fastest) in fastest.iter_mut().enumerate() {
                    let (from, to) = (places[leg], places[leg + 1]);
                    let along = (moment.position - from).dot(&(to - from).normalize());
                    let is_here = distance_to_segment(moment.position, from, to) < 1e-6
                        && (0.03..0.17).contains(&along);
                    *fastest = if is_here { fastest.max(moment.velocity.norm()) } else { *fastest };
                }
            }
            // The way back of the loop on one line has no speed of its own.
            let expected = match (run, path == straight) {
                (Run::Loop, true) => [0.08; 3],
                _ => [0.05, 0.02, 0.08],
            };
            for (found, expected) in fastest.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{run:?} {fastest:?} {expected:?}");
            }
        }
    }
    let wrong = Waypoints {
        places: vec![Point3::origin(), Point3::new(0.1, 0.0, 0.0)],
        speeds: vec![0.0],
        tolerance: 0.005,
    };
    assert!(Trajectory::through(&wrong, &limits, Run::Once).is_err());
}

/// Waypoints on a circle of 10 cm: the ball passes them at full speed, however dense they are.
#[test]
fn dense_waypoints_do_not_slow_the_ball_down() {
    let limits = MotionLimits::with_speed(0.05);
    for (spacing, count) in [(0.01e-3, 40_000), (1e-3, 400), (5e-3, 80), (10e-3, 40)] {
        let place = |k: u32| {
            let angle = f64::from(k) * spacing / 0.1;
            Point3::new(0.1 * angle.cos(), 0.1 * angle.sin(), 0.3)
        };
        let places: Vec<Point3<f64>> = (0..count).map(place).collect();
        let waypoints = Waypoints { places, speeds: Vec::new(), tolerance: 0.005 };
        let trajectory = Trajectory::through(&waypoints, &limits, Run::Once).unwrap();
        assert_within(&trajectory, &limits);
        // 0.4 m, with the start and the end.
        assert!((7.7..8.6).contains(&trajectory.duration()), "{} s", trajectory.duration());
        for moment in moments(&trajectory, 0.05) {
            let off = (moment.position.coords.xy().norm() - 0.1).abs();
            assert!(off < 0.003, "{off} m from the circle");
        }
    }
}

#[test]
fn the_first_breach_is_named_with_its_place() {
    let corners = [[0.3, 0.2, 0.3], [0.6, 0.2, 0.3]].map(Point3::from);
    let waypoints = Waypoints { places: corners.to_vec(), speeds: Vec::new(), tolerance: 0.0 };
    let limits = MotionLimits::with_speed(0.05);
    let trajectory = Trajectory::through(&waypoints, &limits, Run::Once).unwrap();
    let left = |moment: &Moment| match moment.position.x < 0.4 {
        true => Ok(()),
        false => Err(PathError::OpenLoop { gap_mm: 0.0 }),
    };
    let breach = check(&trajectory, &limits, left).unwrap_err();
    assert!((breach.distance_m - 0.1).abs() < 0.001, "{breach}");
    assert!(matches!(breach.rule, Rule::Other(_)), "{breach}");
    let slow = MotionLimits { speed: 0.04, ..limits };
    let breach = check(&trajectory, &slow, anywhere).unwrap_err();
    assert!(matches!(breach.rule, Rule::Speed { .. }), "{breach}");
    let weak = MotionLimits { acceleration: 0.01, ..limits };
    let breach = check(&trajectory, &weak, anywhere).unwrap_err();
    assert!(matches!(breach.rule, Rule::Acceleration { .. }), "{breach}");
}

/// Limits of a usual speed.
fn slow() -> MotionLimits {
    MotionLimits::with_speed(0.05)
}

/// Returns a shape of a size, metres.
fn shape(kind: ShapeKind, size: f64) -> Shape {
    let (centre, plane) = (Point3::new(0.5, 0.3, 0.3), Plane::Level);
    Shape { kind, centre, size, plane, tolerance: 0.005, seed: 1 }
}

/// A number far from those of a rig, and its negative.
fn extreme() -> impl Strategy<Value = f64> {
    let far = [0.0, 1e-308, 1e-300, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e15, 1e308, f64::INFINITY];
    prop_oneof![
        prop::sample::select(far.to_vec()),
        prop::sample::select(far.to_vec()).prop_map(|x| -x),
        Just(f64::NAN),
        prop::num::f64::ANY,
        0.0..1.0,
    ]
}

const KINDS: [ShapeKind; 5] =
    [ShapeKind::Circle, ShapeKind::Line, ShapeKind::Eight, ShapeKind::Square, ShapeKind::Spline];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// No number of a path makes it panic, run for ever, or take what is no motion.
    #[test]
    fn numbers_far_from_those_of_a_rig_are_refused_or_make_a_path(
        kind in prop::sample::select(KINDS.to_vec()),
        numbers in prop::array::uniform8(extreme()),
        usual in prop::array::uniform8(prop::bool::weighted(0.7)),
        is_loop: bool,
    ) {
        let sane = [0.2, 0.005, 0.5, 0.3, 0.3, 0.05, 0.25, 5.0];
        let pick = |i: usize| if usual[i] { sane[i] } else { numbers[i] };
        let all = [0, 1, 2, 3, 4, 5, 6, 7].map(pick);
        let [size, tolerance, x, y, z, speed, acceleration, jerk] = all;
        let run = if is_loop { Run::Loop } else { Run::Once };
        let limits = MotionLimits { speed, acceleration, jerk };
        let shape = Shape { centre: Point3::new(x, y, z), tolerance, ..shape(kind, size) };
        if let Ok(trajectory) = shape.trajectory(&limits, run) {
            let _breach = check(&trajectory, &limits, anywhere);
            for share in [0.0, 0.3, 1.0] {
                let moment = trajectory.at(share * trajectory.span());
                prop_assert!(moment.position.iter().all(|it| it.is_finite()), "{moment:?}");
                prop_assert!(moment.velocity.iter().all(|it| it.is_finite()), "{moment:?}");
            }
        }
    }
}

#[test]
fn wrong_input_is_refused() {
    let places = vec![Point3::new(0.3, 0.2, 0.3), Point3::new(0.6, 0.2, 0.3)];
    let waypoints = Waypoints { places, speeds: Vec::new(), tolerance: 0.005 };
    let limits = MotionLimits::with_speed(0.0);
    let error = Trajectory::through(&waypoints, &limits, Run::Once).unwrap_err();
    assert_eq!(error, PathError::Limit { name: "speed", value: 0.0 });
    let error = shape(ShapeKind::Circle, 1e308).trajectory(&slow(), Run::Once).unwrap_err();
    assert_eq!(error, PathError::Size(1e308));
    let far = Waypoints {
        places: vec![Point3::origin(), Point3::new(0.0, 1e6, 0.0)],
        speeds: Vec::new(),
        tolerance: 0.0,
    };
    let error = Trajectory::through(&far, &slow(), Run::Once).unwrap_err();
    assert_eq!(error, PathError::Far { name: "a coordinate", value: 1e6 });
    let sample = |time| Sample { time, position: Point3::new(time, 0.0, 0.3) };
    let samples = [0.0, 1.0, 1.0].map(sample);
    let error = Trajectory::through_samples(&samples, Run::Once).unwrap_err();
    assert_eq!(error, PathError::TimeNotRising { number: 3 });
    let samples = [0.0, 1.0, 2.0].map(sample);
    let error = Trajectory::through_samples(&samples, Run::Loop).unwrap_err();
    assert_eq!(error, PathError::TooFewInLoop { count: 3, least: 4 });
    let samples = [0.0, 1.0, 2.0, 3.0].map(sample);
    let error = Trajectory::through_samples(&samples, Run::Loop).unwrap_err();
    assert_eq!(error, PathError::OpenLoop { gap_mm: 3000.0 });
}

/// The check of a path looks at it every 5 ms, and the times of a file are often not in seconds.
#[test]
fn a_path_of_more_than_a_day_is_refused() {
    let hours = |error: PathError| match error {
        PathError::TooLong { hours } => hours,
        other => panic!("{other}"),
    };
    let sample = |time| Sample { time, position: Point3::new(0.3 + time / 1e20, 0.0, 0.3) };
    let nanoseconds = [0.0, 2e14, 4e14].map(sample);
    let error = Trajectory::through_samples(&nanoseconds, Run::Once).unwrap_err();
    assert!((hours(error) - 4e14 / 3600.0).abs() < 1.0);
    let places = vec![Point3::new(0.3, 0.2, 0.3), Point3::new(0.6, 0.2, 0.3)];
    let slow = MotionLimits::with_speed(1e-9);
    let waypoints = Waypoints { places, speeds: Vec::new(), tolerance: 0.005 };
    for run in [Run::Once, Run::Loop] {
        let error = Trajectory::through(&waypoints, &slow, run).unwrap_err();
        assert!(hours(error) > 80_000.0);
    }
}
