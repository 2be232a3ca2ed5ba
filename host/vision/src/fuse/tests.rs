//! The fusion on circles that are computed from a known movement.

use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng};

use super::*;
use crate::camera::Intrinsics;

const PERIOD: f64 = 1.0 / 30.0;
const RADIUS_M: f64 = 0.04;
const INTRINSICS: Intrinsics =
    Intrinsics { fx: 533.0, fy: 533.0, cx: 319.5, cy: 239.5, depth_scale: 0.0, distortion: None };

/// Returns a camera `x` metres beside the middle that looks at the point 1.2 m before it.
fn camera(x: f64) -> Camera {
    let pose = Isometry3::face_towards(
        &Point3::new(x, 0.0, 0.0),
        &Point3::new(0.0, 0.0, 1.2),
        &Vector3::y(),
    );
    Camera::new(INTRINSICS, pose, 2.0 * RADIUS_M)
}

fn cameras() -> [Camera; 2] {
    [-0.3, 0.3].map(camera)
}

/// Normal random numbers.
struct Noise(TestRng);

impl Noise {
    fn new(seed: u8) -> Self {
        Self(TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
    }

    fn uniform(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Two free-running cameras, their errors, and the fuser.
struct Stand {
    /// Cameras as they are.
    real: [Camera; 2],
    fuser: PairFuser,
    noise: Noise,
    /// Standard deviation of column, row and radius, pixels.
    sigma: f64,
    /// Exposure of the second camera after that of the first one, seconds.
    offset: f64,
    /// Later stamps of the second camera, seconds.
    late: f64,
    /// Error of both radii, pixels.
    rim: f64,
    /// Whether the cameras see the ball.
    sees: [bool; 2],
    frame: u32,
}

impl Stand {
    fn new(sigma: f64, offset: f64) -> Self {
        let (real, fuser) = (cameras(), PairFuser::new(cameras(), PERIOD));
        let noise = Noise::new(7);
        let (late, rim, sees, frame) = (0.0, 0.0, [true; 2], 0);
        Self { real, fuser, noise, sigma, offset, late, rim, sees, frame }
    }

    /// Returns the circle of one camera for a ball at `place`.
    fn circle(&mut self, side: Side, place: &Point3<f64>) -> Circle {
        let camera = &self.real[side.index()];
        let at = camera.pose.inverse_transform_point(place);
        let (u, v) = INTRINSICS.project(&at).unwrap();
        let distance = at.coords.norm();
        let tangent = (RADIUS_M / distance).asin().tan();
        let radius = INTRINSICS.focal() * tangent * distance / at.z + self.rim;
        let [du, dv, dr] = [0; 3].map(|_| self.sigma * self.noise.normal());
        let covariance = Matrix3::identity() * self.sigma.powi(2);
        Circle { u: u + du, v: v + dv, radius: radius + dr, covariance }
    }

    /// Takes the next picture of each camera. Returns what was fused.
    fn next(&mut self, path: impl Fn(f64) -> Point3<f64>) -> Vec<Fused> {
        let t = 100.0 + f64::from(self.frame) * PERIOD;
        self.frame += 1;
        let mut found = Vec::new();
        for (side, t, late) in [(Side::First, t, 0.0), (Side::Second, t + self.offset, self.late)] {
            let circle = self.circle(side, &path(t));
            let circle = Some(circle).filter(|_| self.sees[side.index()]);
            found.extend(self.fuser.take(side, t + late, circle, t + late + 0.02));
        }
        found
    }

    /// Takes the pictures of so many seconds.
    fn run(&mut self, seconds: f64, path: impl Fn(f64) -> Point3<f64>) -> Vec<Fused> {
        (0..(seconds / PERIOD) as usize).flat_map(|_| self.next(&path)).collect()
    }
}

/// A ball at rest.
fn rest(_: f64) -> Point3<f64> {
    Point3::new(0.03, -0.05, 1.25)
}

/// A ball on an upright circle of 0.1 m radius, 19 cm/s.
fn circling(t: f64) -> Point3<f64> {
    let (sin, cos) = (1.9 * t).sin_cos();
    Point3::new(0.1 * cos, 0.1 * sin, 1.2 + 0.03 * sin)
}

/// Returns the root mean square of the errors, metres, and the mean of e'C⁻¹e.
fn errors(fused: &[Fused], path: impl Fn(f64) -> Point3<f64>) -> (f64, f64) {
    let (mut squares, mut normalised) = (0.0, 0.0);
    for Fused { stamp, position, .. } in fused {
        let error = position.mean - path(*stamp);
        squares += error.norm_squared();
        normalised += error.dot(&(position.covariance.try_inverse().unwrap() * error));
    }
    let count = fused.len() as f64;
    ((squares / count).sqrt(), normalised / count)
}

fn is_pair(fused: &Fused) -> bool {
    matches!(fused.origin, Origin::Pair(_))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Two exact rays meet in one point, wherever it is.
    #[test]
    fn without_noise_a_ball_is_where_it_is(
        x in -0.3..0.3f64, y in -0.2..0.2f64, z in 0.8..1.8f64,
    ) {
        let mut stand = Stand::new(0.0, 0.0);
        let fused = stand.next(|_| Point3::new(x, y, z));
        prop_assert_eq!(fused.len(), 1);
        let error = (fused[0].position.mean - Point3::new(x, y, z)).norm();
        prop_assert!(error < 1e-6 && is_pair(&fused[0]), "{} m", error);
    }

    /// A source of stamps or circles that is broken breaks nothing else: no panic, only finite
    /// positions, and a good pair afterwards is a position again.
    #[test]
    fn wild_stamps_and_circles_are_harmless(
        stamps in prop::collection::vec((prop::bool::ANY, 0..12usize, 0..6usize), 1..60),
    ) {
        let mut stand = Stand::new(0.2, 0.01);
        stand.run(1.0, rest);
        let now = 100.0 + f64::from(stand.frame) * PERIOD;
        for (is_first, kind, other) in stamps {
            let wild = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e300, now + 1e6,
                now + 0.03, now - 0.5, now, now - 2.0, 0.0, -now];
            let side = if is_first { Side::First } else { Side::Second };
            let good = stand.circle(side, &rest(0.0));
            let bad = [good, Circle { radius: f64::NAN, ..good }, Circle { u: 1e300, ..good },
                Circle { covariance: Matrix3::zeros() * f64::NAN, ..good },
                Circle { covariance: -good.covariance, ..good }, Circle { radius: -1.0, ..good }];
            let at = wild[(kind + other) % 12];
            let clock = if kind == 3 { at } else { now };
            if let Some(fused) = stand.fuser.take(side, wild[kind], Some(bad[other]), clock) {
                prop_assert!(fused.stamp.is_finite());
                prop_assert!(fused.position.mean.iter().all(|it| it.is_finite()));
                prop_assert!(fused.position.covariance.cholesky().is_some());
            }
            stand.fuser.poll(wild[other]);
        }
        stand.frame += 60;
        let fused = stand.run(1.0, rest);
        prop_assert!(fused.len() > 20, "{} positions", fused.len());
        prop_assert!((fused[25.min(fused.len() - 1)].position.mean - rest(0.0)).norm() < 0.06);
    }
}

/// Of a normal distribution in 3 dimensions the mean of e'C⁻¹e over n samples is 3 ± sqrt(6 / n).
/// It may be smaller here: the covariance allows for accelerations, which a ball at rest has not.
#[test]
fn the_covariance_is_that_of_the_errors() {
    let mut stand = Stand::new(0.2, 0.012);
    stand.run(2.0, rest);
    let fused = stand.run(100.0, rest);
    let (_, normalised) = errors(&fused, rest);
    let spread = (6.0 / fused.len() as f64).sqrt();
    assert!(normalised < 3.0 + 4.0 * spread && normalised > 2.0, "{normalised}");
    assert_eq!(stand.fuser.alarm(), None);
}

/// Rays of two moments meet where the ball never was: a ball of 19 cm/s moves by 2.8 mm in 15 ms.
#[test]
fn a_moving_ball_is_found_better_than_by_its_newest_pair() {
    let mut stand = Stand::new(0.05, 0.015);
    stand.run(3.0, circling);
    let fused = stand.run(20.0, circling);
    let (fused_rms, normalised) = errors(&fused, circling);
    let mut squares = 0.0;
    for n in 0..600 {
        let t = f64::from(n) * PERIOD;
        let moments = [(Side::First, t), (Side::Second, t + 0.015)];
        let circles = moments.map(|(side, t)| stand.circle(side, &circling(t)));
        let found = intersect(&stand.real, &circles).unwrap();
        squares += (found.mean - circling(t + 0.015)).norm_squared();
    }
    let newest_rms = (squares / 600.0).sqrt();
    assert!(fused_rms < 0.001 && newest_rms > 2.5 * fused_rms, "{fused_rms} {newest_rms}");
    assert!(normalised < 4.0, "{normalised}");
}

/// A camera that stops seeing the ball changes what is known of it, not where it is.
#[test]
fn falling_back_to_one_camera_and_returning_makes_no_jump() {
    let mut stand = Stand::new(0.05, 0.01);
    stand.rim = -0.3;
    let mut last = stand.run(10.0, circling).pop().unwrap();
    for sees in [[true, false], [true; 2], [false, true], [true; 2]] {
        stand.sees = sees;
        let found = stand.run(1.0, circling);
        // One missing picture of either camera may cost a position, not more.
        assert!(found.len() >= 28, "{} positions", found.len());
        for fused in found {
            assert_eq!(is_pair(&fused), sees == [true; 2]);
            let real = circling(fused.stamp) - circling(last.stamp);
            let jump = (fused.position.mean - last.position.mean - real).norm();
            let is_switch = is_pair(&fused) != is_pair(&last);
            assert!(jump < if is_switch { 0.005 } else { 0.01 }, "{jump} m after {last:?}");
            last = fused;
        }
    }
}

/// A ball that stops where one camera sees it: the outline is too coarse to show it at once, but
/// the position stays near and comes back.
#[test]
fn a_ball_that_stops_behind_a_cover_is_followed() {
    let mut stand = Stand::new(0.05, 0.01);
    // Away from the cameras with 19 cm/s from 105 s to 108 s.
    let path = |t: f64| Point3::new(0.02, 0.03, 1.2 + 0.19 * (t.clamp(105.0, 108.0) - 107.0));
    stand.run(7.8, path);
    stand.sees = [true, false];
    let found = stand.run(1.5, path);
    let error = |fused: &Fused| (fused.position.mean - path(fused.stamp)).norm();
    let largest = found.iter().map(error).fold(0.0, f64::max);
    assert!(largest < 0.02 && error(found.last().unwrap()) < 0.006, "{largest}");
}

/// A camera that is late, lost, or gone without a word is replaced by the other's outline.
#[test]
fn one_camera_goes_on_alone_after_one_and_a_half_periods() {
    let mut stand = Stand::new(0.05, 0.01);
    stand.run(3.0, rest);
    let t = 100.0 + f64::from(stand.frame) * PERIOD;
    let circle = |stand: &mut Stand| Some(stand.circle(Side::First, &rest(0.0)));
    for side in Side::BOTH {
        let circle = stand.circle(side, &rest(0.0));
        stand.fuser.take(side, t, Some(circle), t + 0.02);
    }
    let first = circle(&mut stand);
    assert_eq!(stand.fuser.take(Side::First, t + PERIOD, first, t + PERIOD + 0.02), None);
    assert_eq!(stand.fuser.poll(t + 1.4 * PERIOD + 0.02), None);
    let late = stand.fuser.poll(t + 1.6 * PERIOD + 0.02).unwrap();
    assert_eq!((late.stamp, late.origin), (t + PERIOD, Origin::Outline(Side::First)));
    assert_eq!(stand.fuser.poll(t + 1.7 * PERIOD + 0.02), None);
    stand.fuser.lose(Side::Second);
    let t = t + 3.0 * PERIOD;
    let first = circle(&mut stand);
    let alone = stand.fuser.take(Side::First, t, first, t + 0.02).unwrap();
    assert_eq!(alone.origin, Origin::Outline(Side::First));
}

/// The rays of a pair do not depend on the size of the ball: they measure the outline's error.
#[test]
fn the_error_of_the_outline_is_learned() {
    let mut stand = Stand::new(0.2, 0.01);
    stand.rim = 0.4;
    assert_eq!(stand.fuser.radius_error(Side::First), None);
    let pairs = stand.run(20.0, circling);
    let (rms, _) = errors(&pairs[60..], circling);
    assert!(rms < 0.002, "{rms}");
    for side in Side::BOTH {
        let error = stand.fuser.radius_error(side).unwrap();
        assert!((error - 0.4).abs() < 0.08, "{error}");
    }
    assert_eq!(stand.fuser.alarm(), None);
}

/// A ball that moves up and down shows the time between two rays.
#[test]
fn a_difference_of_the_latencies_is_found_and_compensated() {
    let mut stand = Stand::new(0.2, 0.008);
    stand.late = 0.010;
    assert_eq!(stand.fuser.latency_difference(), None);
    stand.run(15.0, circling);
    let found = stand.fuser.latency_difference().unwrap();
    assert!((found - 0.010).abs() < 0.003, "{found}");
    assert_eq!(stand.fuser.alarm(), None);
    let mut level = Stand::new(0.2, 0.008);
    level.run(5.0, rest);
    assert_eq!(level.fuser.latency_difference(), None, "a ball at rest shows nothing");
}

/// A camera that is turned by 1 degree sees everything 9 pixels beside: about one axis the rays
/// miss each other, about the other one they meet at another distance.
#[test]
fn a_knocked_camera_is_told_and_named() {
    for (axis, sign) in [(Vector3::x(), Sign::Residual), (Vector3::y(), Sign::Radius)] {
        for side in Side::BOTH {
            let mut stand = Stand::new(0.2, 0.01);
            stand.run(10.0, rest);
            assert_eq!(stand.fuser.alarm(), None);
            let pose = &mut stand.real[side.index()].pose;
            *pose *= Isometry3::rotation(axis * 1f64.to_radians());
            let after = stand.run(1.0, rest);
            assert_eq!(stand.fuser.alarm(), Some(Alarm { side: Some(side), sign }));
            let last = after.last().unwrap();
            assert_eq!(last.origin, Origin::Outline(side.other()));
            let error = (last.position.mean - rest(0.0)).norm();
            assert!(error < 0.02, "{error}");
        }
    }
}

/// Noise alone is no knock, and an accusation is one.
#[test]
fn no_alarm_without_a_reason() {
    let mut stand = Stand::new(0.2, 0.016);
    stand.late = 0.002;
    stand.run(300.0, circling);
    assert_eq!(stand.fuser.alarm(), None);
    stand.fuser.accuse(Side::First);
    let told = Some(Alarm { side: Some(Side::First), sign: Sign::Told });
    assert_eq!(stand.fuser.alarm(), told);
    let after = stand.run(1.0, circling);
    assert!(after.iter().all(|fused| fused.origin == Origin::Outline(Side::Second)));
    assert!(after.len() > 20);
}

/// A detection that is not the ball is in one camera only: it moves no position.
#[test]
fn a_wrong_detection_of_one_camera_is_not_triangulated() {
    let mut stand = Stand::new(0.1, 0.01);
    stand.run(5.0, rest);
    let t = 100.0 + f64::from(stand.frame) * PERIOD;
    let right = stand.circle(Side::First, &rest(0.0));
    let wrong = Circle { v: right.v + 60.0, ..right };
    stand.fuser.take(Side::First, t, Some(right), t);
    let fused = stand.fuser.take(Side::Second, t + 0.01, Some(wrong), t + 0.01).unwrap();
    assert_eq!(fused.origin, Origin::Outline(Side::First));
    assert!((fused.position.mean - rest(0.0)).norm() < 0.005);
    assert_eq!(stand.fuser.alarm(), None);
}
