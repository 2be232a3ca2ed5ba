//! Balls that are large in the picture, with depth and without it.

use crate::camera::{Camera, Intrinsics};
use crate::detect::BallDetector;
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{Disturbances, seen};
use crate::image::Bgr;
use crate::render::{Ball, Scene};

/// Blue, green and red of a ball of each hue, degrees.
const HUES: [(f64, [f64; 3]); 3] =
    [(0.0, [0.12, 0.08, 0.8]), (60.0, [0.1, 0.7, 0.75]), (210.0, [0.8, 0.4, 0.1])];
/// Depth of the balls, metres.
const NEAR: f64 = 0.3;

/// Returns the lens of a camera with pictures of this size.
fn lens(width: usize, height: usize) -> Intrinsics {
    let focal = 0.82 * width as f64;
    let [cx, cy] = [width, height].map(|n| (n as f64 - 1.0) / 2.0);
    Intrinsics { fx: focal, fy: focal, cx, cy, depth_scale: 1000.0, distortion: None }
}

/// Checks that a ball of `radius` pixels at column `u`, row `v` is found, in a noisy
/// picture of a wall.
fn assert_found(
    (width, height): (usize, usize),
    (u, v): (f64, f64),
    radius: f64,
    hue: usize,
    has_depth: bool,
) {
    let (intrinsics, (degrees, albedo)) = (lens(width, height), HUES[hue]);
    let ball = Ball {
        centre: intrinsics.deproject(u, v, NEAR),
        radius: radius * NEAR / intrinsics.fx,
        albedo,
        light: 1.0,
    };
    let mut scene = Scene::wall(width, height, intrinsics, 2.0);
    scene.add(&ball);
    scene.add_noise(8);
    scene.each_pixel(|_, _, _: &mut Bgr, depth| {
        if !has_depth {
            *depth = 0;
        }
    });
    let pose = nalgebra::Isometry3::identity();
    let camera = Camera { ball_hue: degrees, ..Camera::new(intrinsics, pose, 2.0 * ball.radius) };
    let (truth, mut detector) = (seen(&ball, &intrinsics), ShapeDetector::new(&camera));
    // So near, the outline is wider than the ball at its centre's depth.
    let expected = radius / (1.0 - (ball.radius / NEAR).powi(2)).sqrt();
    // The second frame is searched about the ball of the first one.
    for frame in 0..2 {
        let what = format!("{width}x{height}, {u}, {v}, {radius} px, hue {degrees}, {frame}");
        let found = detector.detect(&scene.frame(0.0).unwrap()).unwrap();
        let circle = found.unwrap_or_else(|| panic!("no ball: {what}")).circle;
        let off = (circle.u - truth.u).hypot(circle.v - truth.v);
        // Off the axis the centre of the outline is not the image of the ball's.
        assert!(off < 0.06 * radius, "{circle:?} {truth:?}: {what}");
        assert!((circle.radius / expected - 1.0).abs() < 0.03, "{circle:?}: {what}");
    }
}

#[test]
fn large_balls_are_found_up_to_nearly_half_the_height() {
    for size @ (width, height) in [(640, 480), (1280, 720), (1920, 1080)] {
        let (width, height) = (width as f64, height as f64);
        for (i, radius) in [80.0, 100.0, 150.0, 0.45 * height].into_iter().enumerate() {
            for hue in 0..HUES.len() {
                let [right, down] = [width, height].map(|n| (n / 2.0 - 1.2 * radius).max(0.0));
                let part = [0.0, 0.7, -0.5][(i + hue) % 3];
                let place = (width / 2.0 + part * right, height / 2.0 - part * down);
                assert_found(size, place, radius, hue, false);
                assert_found(size, place, radius, hue, true);
            }
        }
    }
}

#[test]
fn large_balls_are_found_in_4k() {
    for (i, radius) in [110.0, 300.0, 972.0].into_iter().enumerate() {
        assert_found((3840, 2160), (1700.0 + 100.0 * i as f64, 1100.0), radius, i, false);
    }
}
