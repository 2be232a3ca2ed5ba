//! The interface: factory, errors, trace and parameters.

use std::error::Error;

use super::{in_front_of_wall, usual_ball};
use crate::detect::ball::ShapeDetector;
use crate::detect::scene::{camera, wall};
use crate::detect::shape::{SearchParameters, ShapeParameters};
use crate::detect::{BallDetector, DetectError, DetectorKind};

#[test]
fn detectors_are_made_by_name() {
    for kind in DetectorKind::ALL {
        assert_eq!(DetectorKind::from_name(kind.name()), Some(kind));
        assert_eq!(kind.build(&camera()).name(), kind.name());
    }
    assert_eq!(DetectorKind::from_name("green"), None);
}

#[test]
fn an_error_keeps_its_cause() {
    let cause = std::io::Error::other("out of memory");
    let error = DetectError::processing(cause);
    assert_eq!(error.to_string(), "image processing failed");
    assert_eq!(error.source().unwrap().to_string(), "out of memory");
}

#[test]
fn the_trace_shows_what_was_observed() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let mut detector = ShapeDetector::new(&camera());
    for searches in [1, 1] {
        let (ball, trace) = detector.detect_traced(&scene.frame(0.0).unwrap()).unwrap();
        let (ball, last) = (ball.unwrap(), trace.searches.last().unwrap());
        assert_eq!(trace.searches.len(), searches);
        let best = last.best().unwrap();
        assert_eq!(best.score(), ball.score);
        assert_eq!((best.circle.disc.u, best.circle.disc.v), (ball.circle.u, ball.circle.v));
        assert!(!last.spheres.is_empty());
    }
    // A lost ball: the window, then the whole image.
    let (ball, trace) = detector.detect_traced(&wall(2.2).frame(0.0).unwrap()).unwrap();
    assert_eq!((ball, trace.searches.len()), (None, 2));
}

#[test]
fn parameters_are_used() {
    let (scene, _) = in_front_of_wall(&usual_ball());
    let search = SearchParameters { min_score: 1.1, ..SearchParameters::DEFAULT };
    let parameters = ShapeParameters { search, ..ShapeParameters::DEFAULT };
    let mut detector = ShapeDetector::with_parameters(&camera(), parameters);
    assert_eq!(detector.detect(&scene.frame(0.0).unwrap()).unwrap(), None);
}
