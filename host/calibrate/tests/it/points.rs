//! The pose from known places of the ball and from the motors.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Translation3, UnitQuaternion};
use plumb_calibrate::calibration::{CalibrationError, Grade};
use plumb_calibrate::motors::{MotorMeasures, SeenMotor, pose_from_motors};
use plumb_calibrate::places::{BallPlace, PLACE_SD_M, mean_of, pose_from_places};
use plumb_frame::camera::Intrinsics;
use plumb_frame::observation::Gaussian3;
use plumb_protocol::{PerAxis, PerMotor};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const INTRINSICS: Intrinsics = Intrinsics {
    fx: 525.0,
    fy: 525.0,
    cx: 319.5,
    cy: 239.5,
    depth_scale: 5000.0,
    distortion: None,
};

/// The paper's motors A, B, C.
const MOTORS: PerMotor<PerAxis<f64>> =
    [[0.850, 0.610, 0.665], [0.850, 0.0, 0.665], [0.0, 0.240, 0.665]];

/// Places of the ball with measured coordinates.
const PLACES: [PerAxis<f64>; 6] = [
    [0.2, 0.2, 0.1],
    [0.7, 0.1, 0.1],
    [0.7, 0.5, 0.1],
    [0.4, 0.3, 0.4],
    [0.6, 0.2, 0.35],
    [0.5, 0.4, 0.2],
];

/// A camera that looks along -x at the rig, turned and tilted a little.
fn pose() -> Isometry3<f64> {
    let along_x = nalgebra::Quaternion::new(0.5, -0.5, -0.5, 0.5);
    let askew = UnitQuaternion::from_euler_angles(0.1, -0.05, 0.15);
    let rotation = askew * UnitQuaternion::from_quaternion(along_x);
    Isometry3::from_parts(Translation3::new(1.737, 0.286, 0.35), rotation)
}

/// Returns a place as the camera sees it, with an error of the standard deviation `sd`, metres.
fn place(known: PerAxis<f64>, sd: f64, random: &mut ChaCha8Rng) -> BallPlace {
    let known = Point3::from(known);
    let normal = Normal::new(0.0, sd).unwrap();
    let mean = pose().inverse_transform_point(&known).map(|x| x + normal.sample(random));
    let covariance = Matrix3::identity() * 0.002_f64.powi(2);
    BallPlace { known, known_sd: PLACE_SD_M, seen: Gaussian3 { mean, covariance } }
}

fn places(sd: f64, seed: u64) -> Vec<BallPlace> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    PLACES.iter().map(|&known| place(known, sd, &mut random)).collect()
}

#[test]
fn the_pose_is_recovered_from_places() {
    for seed in 0..50 {
        let found = pose_from_places(&places(0.003, seed)).unwrap();
        let error = pose().inverse() * found.pose;
        assert!(error.rotation.angle() < 0.05, "{seed}: {error}");
        assert_eq!(found.outliers().count(), 0, "{seed}");
        assert!(found.held_out().unwrap() < 0.02, "{seed}: {found:?}");
        let at = pose().inverse_transform_point(&Point3::new(0.5, 0.3, 0.2));
        assert!((found.pose * at - pose() * at).norm() < 0.01, "{seed}");
    }
    assert_eq!(pose_from_places(&places(0.001, 1)).unwrap().grade(), Grade::Good);
}

#[test]
fn the_stated_error_is_the_true_one() {
    let seeds = 0..200;
    let ratios = seeds.map(|seed| {
        let found = pose_from_places(&places((2e-3_f64).hypot(PLACE_SD_M), seed)).unwrap();
        let angle = (pose().inverse() * found.pose).rotation.angle();
        (angle / found.rotation_sd).powi(2)
    });
    let mean = (ratios.sum::<f64>() / 200.0).sqrt();
    assert!((0.75..1.25).contains(&mean), "{mean}");
}

#[test]
fn a_wrong_place_is_named_and_left_out() {
    let mut with_outlier = places(0.002, 3);
    with_outlier[2].known.y += 0.08;
    let found = pose_from_places(&with_outlier).unwrap();
    let names: Vec<_> = found.outliers().map(|sample| sample.name.as_str()).collect();
    assert_eq!(names, ["place 3"]);
    let error = pose().inverse() * found.pose;
    assert!(error.rotation.angle() < 0.05, "{error}");
}

#[test]
fn sets_of_places_that_do_not_determine_the_pose_are_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut refusal = |known: &[PerAxis<f64>]| {
        let places: Vec<_> = known.iter().map(|&it| place(it, 0.001, &mut random)).collect();
        pose_from_places(&places).unwrap_err()
    };
    let too_few = refusal(&PLACES[..3]);
    assert_eq!(too_few.to_string(), "too few places of the ball: 3, and 4 are needed");
    let line = [0.0, 0.1, 0.2, 0.3].map(|x| [0.2 + x, 0.3, 0.1 + x / 2.0]);
    assert!(matches!(refusal(&line), CalibrationError::OnALine { .. }));
    let plane = [[0.2, 0.2, 0.1], [0.7, 0.1, 0.1], [0.7, 0.5, 0.1], [0.4, 0.4, 0.1]];
    assert!(matches!(refusal(&plane), CalibrationError::InAPlane { .. }));
}

#[test]
fn a_mirrored_frame_is_refused() {
    let swapped = |place: BallPlace| {
        let known = Point3::new(place.known.y, place.known.x, place.known.z);
        BallPlace { known, ..place }
    };
    let mirrored: Vec<_> = places(0.002, 5).into_iter().map(swapped).collect();
    assert_eq!(pose_from_places(&mirrored).unwrap_err(), CalibrationError::Mirrored);
    // Also of the least number of places, where no place can be left out.
    let four = [mirrored[0], mirrored[1], mirrored[2], mirrored[3]];
    assert_eq!(pose_from_places(&four).unwrap_err(), CalibrationError::Mirrored);
}

#[test]
fn contradicting_places_and_wrong_units_are_reported() {
    let mut wrong = places(0.002, 6);
    for (i, place) in wrong.iter_mut().enumerate() {
        place.known.x += [0.1, -0.1, 0.05, 0.0, -0.05, 0.08][i];
    }
    let error = pose_from_places(&wrong).unwrap_err();
    assert!(matches!(&error, CalibrationError::Inconsistent { residuals } if residuals.len() == 6));
    assert!(error.to_string().contains("place 1 is off by"), "{error}");

    // A depth scale that is 4 % off.
    let mut scaled = places(0.0, 7);
    for place in &mut scaled {
        place.seen.mean.coords *= 1.04;
        place.seen.covariance *= 100.0;
    }
    let found = pose_from_places(&scaled).unwrap();
    assert!(found.findings[0].contains("4.0 % farther apart"), "{:?}", found.findings);
}

#[test]
fn the_mean_of_observations_ignores_a_wrong_frame() {
    let at = |z: f64| Gaussian3 { mean: Point3::new(0.0, 0.0, z), covariance: Matrix3::identity() };
    let mean = mean_of(&[at(1.0), at(1.01), at(3.0)]).unwrap();
    assert_eq!(mean.mean.z, 1.01);
    assert_eq!(mean_of(&[]), None);
}

/// Returns the motors as the camera sees them.
fn seen_motors(motors: PerMotor<PerAxis<f64>>) -> PerMotor<SeenMotor> {
    motors.map(|motor| {
        let p = pose().inverse_transform_point(&Point3::from(motor));
        let (u, v) = INTRINSICS.project(&p).unwrap();
        SeenMotor { pixel: Point2::new(u, v), depth: p.z }
    })
}

#[test]
fn the_frame_of_the_motors_needs_their_height_alone() {
    let seen = seen_motors(MOTORS);
    let found = pose_from_motors(&seen, &MotorMeasures::Height(0.665), &INTRINSICS).unwrap();
    // The paper's frame has its origin below C in x and below B in y.
    let error = pose().inverse() * found.pose;
    assert!(error.translation.vector.norm() < 1e-6 && error.rotation.angle() < 1e-6, "{error}");
    assert!(found.findings[0].contains("AB 0.610 m"), "{:?}", found.findings);
    assert_eq!(found.held_out(), None);
}

#[test]
fn measured_motors_give_the_users_own_origin() {
    let shifted = MOTORS.map(|[x, y, z]| Point3::new(x - 0.4, y + 0.1, z + 1.0));
    let seen = seen_motors(MOTORS);
    let found = pose_from_motors(&seen, &MotorMeasures::Places(shifted), &INTRINSICS).unwrap();
    let expected = Translation3::new(-0.4, 0.1, 1.0) * pose();
    let error = expected.inverse() * found.pose;
    assert!(error.translation.vector.norm() < 1e-6 && error.rotation.angle() < 1e-6, "{error}");
}

#[test]
fn a_wrong_side_and_wrong_letters_are_reported() {
    let mut places = MOTORS.map(Point3::from);
    places[2].x -= 0.06;
    let found = pose_from_motors(&seen_motors(MOTORS), &MotorMeasures::Places(places), &INTRINSICS);
    let findings = found.unwrap().findings;
    assert!(findings.iter().any(|it| it.contains("motor C to motor A")), "{findings:?}");

    let [a, b, c] = seen_motors(MOTORS);
    for wrong in [[b, a, c], [a, c, b], [c, b, a]] {
        let error = pose_from_motors(&wrong, &MotorMeasures::Height(0.665), &INTRINSICS);
        let error = error.unwrap_err();
        assert!(matches!(error, CalibrationError::Letters { .. }), "{error}");
    }
    let line = seen_motors([[0.85, 0.6, 0.6], [0.85, 0.0, 0.6], [0.85, 0.3, 0.6]]);
    let error = pose_from_motors(&line, &MotorMeasures::Height(0.665), &INTRINSICS).unwrap_err();
    assert!(matches!(error, CalibrationError::OnALine { .. }), "{error}");
    assert!(error.to_string().contains("Check the pixels first."), "{error}");
}
