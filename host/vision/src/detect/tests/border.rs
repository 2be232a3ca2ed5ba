//! Balls far off the optical axis of a wide lens.

use crate::camera::{Camera, Intrinsics};
use crate::detect::BallDetector;
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{INTRINSICS, camera, red_ball, seen};
use crate::render::Scene;

#[test]
fn a_ball_that_is_seen_as_an_ellipse_is_found_without_depth() {
    // In the corners the ball is 1.6 times as long as wide.
    let intrinsics = Intrinsics { fx: 300.0, fy: 300.0, ..INTRINSICS };
    let mut detector = ShapeDetector::new(&Camera { intrinsics, ..camera() });
    for (u, v) in [(30.0, 240.0), (320.0, 30.0), (50.0, 40.0), (590.0, 440.0), (600.0, 60.0)] {
        for z in [0.4, 0.6, 0.9] {
            let ball = red_ball(intrinsics.deproject(u, v, z));
            let mut scene = Scene::wall(640, 480, intrinsics, 2.2);
            scene.add(&ball);
            scene.each_pixel(|_, _, _, depth| *depth = 0);
            let truth = seen(&ball, &intrinsics);
            detector.reset();
            let (found, trace) = detector.detect_traced(&scene.frame(0.0).unwrap());
            let found = found.unwrap_or_else(|| panic!("lost at {u}, {v}, {z} m"));
            let miss = (found.circle.u - truth.u).hypot(found.circle.v - truth.v) / truth.radius;
            assert!(miss < 0.1, "{miss} radii off at {u}, {v}, {z} m");
            // The rays end on the ball's cone.
            let ahead = ball.centre.coords;
            for (u, v) in trace.searches[0].best().unwrap().ray_places.into_iter().flatten() {
                let sine = ahead.angle(&intrinsics.deproject(u, v, 1.0).coords).sin();
                let expected = ball.radius / ahead.norm();
                assert!((sine / expected - 1.0).abs() < 0.15, "{sine} {expected} at {u}, {v}");
            }
        }
    }
}
