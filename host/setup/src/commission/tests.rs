use nalgebra::{Matrix3, Point3, Vector3};
use plumb_runtime::rig::Rig;

use super::*;

/// Displacements of the paper's ball at P0 for a step that pays out, metres: columns A, B, C.
fn paper() -> Matrix3<f64> {
    let rig = Rig::paper().unwrap();
    let simulation = rig.simulation.unwrap();
    let rays =
        simulation.motors().map(|motor| (simulation.start() - motor).normalize().transpose());
    Matrix3::from_rows(&rays).try_inverse().unwrap() * 0.000_471
}

/// Response to a jog of 40 steps with these displacements for a step.
fn response(per_step: Vector3<f64>) -> Response {
    let probe = |steps: f64| Probe {
        steps,
        moved: per_step * steps,
        remainder: Vector3::zeros(),
        sd: 0.0004,
    };
    Response { out: probe(40.0), wound: probe(-40.0) }
}

/// Report of the paper's rig with this wiring, seen in this frame.
fn report(wiring: Wiring, frame: Frame, ball: Point3<f64>) -> Report {
    let (rig, jacobian) = (Rig::paper().unwrap(), paper());
    let responses = [0, 1, 2].map(|output| {
        let sign = if wiring.reversed[output] { -1.0 } else { 1.0 };
        response(frame.matrix() * jacobian.column(wiring.motors[output]) * sign)
    });
    Report::of(&rig, ball, responses)
}

const INSIDE: Point3<f64> = Point3::new(0.54, 0.22, 0.459);
const OUTSIDE: Point3<f64> = Point3::new(-0.54, 0.22, 0.459);

#[test]
fn a_right_rig_has_no_fault() {
    for ball in [INSIDE, OUTSIDE] {
        let report = report(Wiring::RIGHT, Frame::RIGHT, ball);
        assert!(report.is_right() && report.alternatives.is_empty(), "{report:?}");
    }
}

#[test]
fn every_wiring_is_named() {
    for wiring in Wiring::all() {
        let report = report(wiring, Frame::RIGHT, INSIDE);
        let expected = Explanation { wiring, frame: Frame::RIGHT };
        assert_eq!(report.explanation, Some(expected), "{wiring:?}: {:?}", report.alternatives);
    }
}

#[test]
fn every_frame_is_named_where_the_ball_is_seen_outside() {
    for (mirrored, inverted) in [(false, false), (true, false), (false, true), (true, true)] {
        for frame in Frame::turned(mirrored, inverted) {
            let report = report(Wiring::RIGHT, frame, OUTSIDE);
            let expected = Explanation { wiring: Wiring::RIGHT, frame };
            let mut named = report.explanation.iter().chain(&report.alternatives);
            assert!(named.any(|one| *one == expected), "{frame:?}: {:?}", report.explanation);
        }
    }
}

/// Two exchanged plugs are the mirror image of the rig. The place of the ball decides which is more
/// likely, and both are named.
#[test]
fn a_swap_looks_like_a_mirrored_picture() {
    let swapped = Wiring { motors: [1, 0, 2], ..Wiring::RIGHT };
    let inside = report(swapped, Frame::RIGHT, INSIDE);
    assert_eq!(inside.faults, [Fault::Swapped(Output::A, Output::B)]);
    let outside = report(swapped, Frame::RIGHT, OUTSIDE);
    assert_eq!(outside.faults, [Fault::Mirrored]);
    let swap = Explanation { wiring: swapped, frame: Frame::RIGHT };
    assert!(outside.alternatives.contains(&swap), "{outside:?}");
}

#[test]
fn a_motor_that_stands_a_slack_cable_and_a_slipping_one_are_named() {
    let rig = Rig::paper().unwrap();
    let right = paper();
    let responses = |b: Response| {
        let [a, _, c] = [0, 1, 2].map(|k| response(right.column(k).into()));
        [a, b, c]
    };
    let follows = response(right.column(1).into());
    let still = response(Vector3::zeros());
    let named = |b: Response| Report::of(&rig, INSIDE, responses(b)).faults;
    assert_eq!(named(still), [Fault::Still(Output::B)]);
    assert_eq!(named(Response { out: still.out, ..follows }), [Fault::Slack(Output::B)]);
    let mut slips = follows;
    slips.wound.remainder = -0.5 * slips.wound.moved;
    assert_eq!(named(slips), [Fault::Slips(Output::B)]);
}

#[test]
fn only_motors_on_their_own_outputs_are_corrected() {
    let wiring = Wiring { motors: [0, 2, 1], reversed: [true, true, false] };
    let report = report(wiring, Frame::RIGHT, INSIDE);
    assert_eq!(report.corrected_directions([false; 3]), Some([true, false, false]));
    assert_eq!(report.corrected_directions([true, true, false]), Some([false, true, false]));
}

#[test]
fn a_turned_frame_that_still_works_is_measured() {
    let frame = Frame { yaw_deg: 15, ..Frame::RIGHT };
    let report = report(Wiring::RIGHT, frame, INSIDE);
    assert!(report.is_right(), "{report:?}");
    assert!((5.0..16.0).contains(&report.yaw_deg), "{}", report.yaw_deg);
}
