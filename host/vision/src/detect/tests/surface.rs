//! What the detector reads of the surface on a disc.

use super::{ball_at, in_front_of_wall};
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{INTRINSICS, camera};
use crate::detect::shape::{Curvature, Features};
use crate::render::Scene;

#[test]
fn a_cable_close_in_front_does_not_flatten_the_ball() {
    let z = 0.6;
    for aside in [-0.7, -0.35, 0.0, 0.35, 0.7] {
        for gap in [0.45, 0.5, 0.55, 0.6] {
            // Where the cable crosses, the ball's surface is nearer than its centre by `height`.
            let height = f64::sqrt(1.0 - aside * aside);
            let depth_of_cable = ((z - (height + gap) * 0.03) * INTRINSICS.depth_scale) as u16;
            let (mut scene, truth) = in_front_of_wall(&ball_at(250.0, 200.0, z));
            scene.each_pixel(|_, at, pixel, depth| {
                let off = (f64::from(at.0) - truth.u) / truth.radius;
                if f64::abs(off - aside) < 0.1 {
                    (*pixel, *depth) = ([230; 3], depth_of_cable);
                }
            });
            let Curvature { least, most } = curvature_of_best(&scene);
            let is_round = least < 1.1 && most > 0.9;
            assert!(is_round, "{gap} radii in front, {aside} beside the middle: {least} to {most}");
        }
    }
}

/// Returns the curvature of the candidate with the highest score.
fn curvature_of_best(scene: &Scene) -> Curvature {
    let frame = scene.frame(0.0).unwrap();
    let (_, trace) = ShapeDetector::new(&camera()).detect_traced(&frame);
    let best = trace.searches.last().unwrap().best().expect("no candidate");
    match best.decision.as_ref().unwrap().features {
        Some(Features::Depth(features)) => features.curvature.expect("too little depth"),
        other => panic!("no features with depth: {other:?}"),
    }
}
