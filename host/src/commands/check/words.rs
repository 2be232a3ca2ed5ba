//! The result of a check in words.

use plumb_setup::commission::{Fault, Output, Report};

/// Question before the first jog.
pub(super) const QUESTION: &str = "\
Each motor turns a little, one after the other, both ways and back: by one revolution or 60 mm of
cable at most. The ball moves by a few centimetres. Keep a hand at the emergency button. Go on?";

/// Turn of the camera's pose from which it is worth another calibration, degrees.
const WORTH_CALIBRATING_DEG: f64 = 5.0;

/// Prints what the ball did and what follows from it.
pub(super) fn tell_report(report: &Report) {
    let [x, y, z] = [0, 1, 2].map(|axis| report.ball[axis]);
    let place = if report.is_inside { "inside" } else { "OUTSIDE" };
    note!("the ball is seen at ({x:.3}, {y:.3}, {z:.3}) m, {place} the workspace");
    for (output, response) in Output::ALL.into_iter().zip(&report.responses) {
        let [x, y, z] = [0, 1, 2].map(|axis| response.out.moved[axis] * 1e3);
        let steps = response.out.steps;
        note!("output {output}, {steps:.0} steps: the ball moves by ({x:.1}, {y:.1}, {z:.1}) mm");
    }
    for fault in &report.faults {
        tell!("fault: {fault}");
    }
    tell_alternatives(report);
    tell_verdict(report);
}

fn tell_alternatives(report: &Report) {
    if report.alternatives.is_empty() {
        return;
    }
    for alternative in &report.alternatives {
        let faults: Vec<String> = alternative.faults().iter().map(Fault::to_string).collect();
        tell!("or, which would look the same: {}", faults.join(" "));
    }
    tell!(
        "To tell them apart, `plumb jog` each output and look at the motors: does the one with the \
         same letter turn, and does + pay cable out? If so, the camera's pose is wrong."
    );
}

fn tell_verdict(report: &Report) {
    if let Some(doubt) = &report.doubt {
        tell!("fault: {}.", doubt.with_advice());
    }
    let degrees = report.yaw_deg;
    if degrees.abs() >= WORTH_CALIBRATING_DEG && report.explanation.is_some() {
        tell!(
            "note: the camera's pose seems turned about the vertical by {degrees:.0} degrees; \
             `plumb calibrate` makes it exact"
        );
    }
    if report.explanation.is_none() {
        tell!(
            "fault: no wiring and no turned camera explains how the ball moves. Look whether \
             something touches the ball or a cable, run `plumb calibrate`, and check [size] of the \
             rig file."
        );
    } else if !report.is_right() {
        tell!("Mend this, and check again: a fault can hide another one.");
    } else if report.is_inside {
        note!("the rig is right: each output turns its motor the right way, and the ball follows");
    } else {
        tell!(
            "the motors are right, but the ball is seen outside the workspace: hang it inside \
             with `plumb jog`, or correct the camera's pose with `plumb calibrate`"
        );
    }
}
