//! The interface: factory, errors, trace and parameters.

use super::{in_front_of_wall, usual_ball};
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{camera, wall};
use crate::detect::shape::{ProposeParameters, SearchParameters, ShapeParameters};
use crate::detect::{BallDetector, DetectorKind};

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
