//! The interface: factory, errors, trace and parameters.

use super::{ball_at, in_front_of_wall, usual_ball};
use crate::camera::Intrinsics;
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{camera, wall};
use crate::detect::shape::{ProposeParameters, SearchParameters, ShapeParameters};
use crate::detect::{BallDetector, DetectorKind};
use crate::frame::RgbdFrame;
use crate::render::Scene;

#[test]
fn each_kind_makes_its_detector() {
    for kind in DetectorKind::ALL {
        assert_eq!(kind.build(&camera()).name(), kind.name());
    }
}

#[test]
fn the_trace_shows_what_was_observed() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let mut detector = ShapeDetector::new(&camera());
    for _ in 0..2 {
        let (ball, trace) = detector.detect_traced(&scene.frame(0.0).unwrap());
        let (ball, last) = (ball.unwrap(), trace.searches.last().unwrap());
        assert_eq!(trace.searches.len(), 1);
        let best = last.best().unwrap();
        assert_eq!(best.score(), ball.score);
        assert_eq!((best.circle.disc.u, best.circle.disc.v), (ball.circle.u, ball.circle.v));
        assert!(!last.spheres.is_empty());
    }
    // A lost ball: the window, then the whole image.
    let (ball, trace) = detector.detect_traced(&wall(2.2).frame(0.0).unwrap());
    assert_eq!((ball, trace.searches.len()), (None, 2));
}

#[test]
fn each_stage_has_an_image() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let frame = scene.frame(0.0).unwrap();
    let all = ["1-proposals", "2-outline", "3-features", "4-score"];
    for (kind, stages) in [(DetectorKind::Ball, &all[..]), (DetectorKind::Red, &all[3..])] {
        let (ball, images) = kind.build(&camera()).detect_with_stages(&frame).unwrap();
        assert_eq!(images.iter().map(|image| image.name).collect::<Vec<_>>(), stages);
        assert_eq!(ball, kind.build(&camera()).detect(&frame).unwrap());
    }
}

#[test]
fn no_ball_has_more_than_the_largest_score() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let search = SearchParameters { min_score: 1.1, ..SearchParameters::DEFAULT };
    let parameters = ShapeParameters { search, ..ShapeParameters::DEFAULT };
    let mut detector = ShapeDetector::with_parameters(&camera(), parameters);
    assert_eq!(detector.detect(&scene.frame(0.0).unwrap()).unwrap(), None);
}

#[test]
fn the_search_goes_on_if_a_likely_place_is_not_the_ball() {
    // The first place counts as likely, the second as less promising. No circle is good enough.
    let propose = ProposeParameters {
        likely: f64::NEG_INFINITY,
        rival_log_odds: 0.0,
        ..ProposeParameters::DEFAULT
    };
    let search =
        SearchParameters { min_score: 1.1, certain_score: 1.1, ..SearchParameters::DEFAULT };
    let parameters = ShapeParameters { propose, search, ..ShapeParameters::DEFAULT };
    // Two balls without depth.
    let mut scene = wall(2.2);
    scene.each_pixel(|_, (u, v), pixel, depth| {
        for (column, row) in [(200, 150), (450, 300)] {
            let (x, y) = (f64::from(u - column) / 30.0, f64::from(v - row) / 30.0);
            if x * x + y * y < 1.0 {
                *pixel = [20, 15, (70.0 + 130.0 * (1.0 - x * x - y * y).sqrt()) as u8];
            }
        }
        *depth = 0;
    });
    let mut detector = ShapeDetector::with_parameters(&camera(), parameters);
    let (found, trace) = detector.detect_traced(&scene.frame(0.0).unwrap());
    let search = &trace.searches[0];
    assert_eq!((found, search.left_out()), (None, 0));
    let columns: Vec<f64> = search.candidates.iter().map(|place| place.start.u).collect();
    let is_refined = |column: f64| columns.iter().any(|u| (u - column).abs() < 10.0);
    assert!(is_refined(200.0) && is_refined(450.0), "{columns:?}");
}

/// Returns `frame` with its depth times `factor`.
fn scaled(frame: &RgbdFrame, factor: f64) -> RgbdFrame {
    let intrinsics = *frame.intrinsics();
    let intrinsics = Intrinsics { depth_scale: intrinsics.depth_scale / factor, ..intrinsics };
    let (colour, depth) = (frame.colour().clone(), frame.depth().clone());
    RgbdFrame::new(frame.time(), colour, depth, intrinsics).unwrap()
}

#[test]
fn depth_of_a_wrong_scale_differs_from_that_of_the_outline() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let frame = scene.frame(0.0).unwrap();
    let radius = camera().ball_diameter / 2.0;
    for factor in [0.5, 0.8, 0.9, 1.0, 1.1, 1.25, 2.0] {
        let scaled_depth = (0.9 - radius) * factor + radius;
        let (frame, mut detector) = (scaled(&frame, factor), ShapeDetector::new(&camera()));
        let found = detector.detect(&frame).unwrap().and_then(|ball| ball.depths);
        let depths = found.or(detector.compare_depths(&frame).unwrap()).unwrap();
        assert!((depths.by_outline - 0.9).abs() < 0.015, "{factor}: {depths:?}");
        assert!((depths.by_pixels - scaled_depth).abs() < 0.02, "{factor}: {depths:?}");
    }
}

#[test]
fn another_ball_is_a_rival() {
    for has_depth in [true, false] {
        let (mut scene, _) = in_front_of_wall(&usual_ball());
        let rival = |scene: &Scene| {
            let frame = scene.frame(0.0).unwrap();
            let frame = if has_depth { frame } else { scaled(&frame, f64::INFINITY) };
            let mut detector = ShapeDetector::new(&camera());
            let ball = detector.detect(&frame).unwrap().unwrap();
            detector.has_rival(&frame, &ball).unwrap()
        };
        assert!(!rival(&scene));
        scene.add(&ball_at(420.0, 260.0, 1.1));
        assert!(rival(&scene), "{has_depth}");
    }
}
