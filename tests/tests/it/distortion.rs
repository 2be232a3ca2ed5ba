//! A lens with a strong distortion: the detector finds the ball all over the picture, its position
//! is as accurate as without distortion, and the ball reaches its target.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_runtime::rig::LawName;
use plumb_sim::synthetic::{RenderOptions, Scene, SyntheticCamera};
use plumb_tests::plain_room;
use plumb_vision::camera::{Camera, Distortion, DistortionCoefficients};
use plumb_vision::detect::DetectorKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Balls for each lens.
const BALLS: usize = 120;

/// Distortion of a wide cheap lens: it moves the corners of the paper's picture, which is 63
/// degrees wide, by 60 pixels.
const BARREL: DistortionCoefficients =
    DistortionCoefficients { k1: -0.3, k2: 0.1, p1: 0.001, p2: -0.001, k3: 0.0 };
/// Distortion of the other sign.
const PINCUSHION: DistortionCoefficients =
    DistortionCoefficients { k1: 0.25, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };

/// Returns the paper's camera with this distortion.
fn camera(coefficients: DistortionCoefficients, has_depth: bool) -> Camera {
    let mut camera = camera_file::paper().expect("the paper's camera");
    camera.intrinsics.distortion = Distortion::new(coefficients);
    if !has_depth {
        camera.intrinsics.depth_scale = 0.0;
    }
    camera
}

/// Positions of balls all over the picture.
#[derive(Debug)]
struct Survey {
    /// Part of the balls that are found.
    found: f64,
    /// Median distance of the position from the ball's centre, metres.
    median_error: f64,
    /// Mean of e' C⁻¹ e.
    normalised: f64,
}

fn survey(camera: &Camera) -> Survey {
    let mut random = ChaCha8Rng::seed_from_u64(14);
    let background = plain_room::background();
    let options = RenderOptions::default();
    let mut synthetic =
        SyntheticCamera::new(camera.clone(), background, options, 14).expect("a synthetic camera");
    let (mut errors, mut sum) = (Vec::new(), 0.0);
    for _ in 0..BALLS {
        let z = random.random_range(0.6..1.5);
        let (u, v) = (random.random_range(40.0..600.0), random.random_range(40.0..440.0));
        let centre: Point3<f64> = camera.pose * camera.intrinsics.deproject(u, v, z);
        let scene = Scene { ball: Some(centre), ..Scene::default() };
        let frame = synthetic.render(0.0, &scene).expect("a frame");
        let mut detector = DetectorKind::Ball.build(camera);
        let ball = detector.detect(&frame).expect("a search");
        let Some(position) = ball.and_then(|ball| ball.position) else { continue };
        let error = position.mean - centre;
        let information = position.covariance.try_inverse().expect("a covariance");
        sum += error.dot(&(information * error));
        errors.push(error.norm());
    }
    errors.sort_by(f64::total_cmp);
    let n = errors.len() as f64;
    let found = n / BALLS as f64;
    Survey { found, median_error: errors[errors.len() / 2], normalised: sum / n }
}

#[test]
fn a_ball_is_found_all_over_a_distorted_picture() {
    for has_depth in [true, false] {
        let plain = survey(&camera(DistortionCoefficients::default(), has_depth));
        println!("without distortion, depth {has_depth}: {plain:?}");
        for (name, lens) in [("barrel", BARREL), ("pincushion", PINCUSHION)] {
            let bent = survey(&camera(lens, has_depth));
            println!("{name}, depth {has_depth}: {bent:?}");
            assert!(bent.found >= plain.found - 0.03, "{name}: {bent:?}, straight {plain:?}");
            assert!(bent.median_error < 1.5 * plain.median_error, "{name}: {bent:?}");
            let ratio = bent.normalised / plain.normalised;
            assert!((0.7..1.4).contains(&ratio), "{name}: {bent:?}, straight {plain:?}");
        }
    }
}

#[test]
fn a_ball_reaches_its_target_through_a_distorted_picture() {
    for has_depth in [true, false] {
        let drive = |lens| plain_room::drive(&camera(lens, has_depth), LawName::Taut, 1);
        let (plain, bent) = (drive(DistortionCoefficients::default()), drive(BARREL));
        println!("depth {has_depth}: straight {plain:?}, bent {bent:?}");
        assert!(bent.reached && bent.seconds < 60.0, "{bent:?}");
        assert!(bent.true_error < plain.true_error + 0.003, "{bent:?}, straight {plain:?}");
    }
}
