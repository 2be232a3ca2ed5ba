//! The result of a check in words.

use plumb_runtime::commission::{Doubt, Fault, Measurement, Output, Report};
use plumb_runtime::rig::Stiffness;

use super::super::print::{note, tell};

/// Question before the first jog.
pub(super) const QUESTION: &str = "\
Each motor turns a little, one after the other, both ways and back: by one revolution or 60 mm of
cable at most. The ball moves by a few centimetres. At the end a motor turns to and fro for a few
seconds, and the ball swings. Keep a hand at the emergency button. Go on?";

/// Turn of the camera's pose from which it is worth another calibration, degrees.
const WORTH_CALIBRATING_DEG: f64 = 5.0;

/// Prints what the ball did and what follows from it. The rig file says that the cables have the
/// stiffness `file`.
pub(super) fn tell_report(report: &Report, file: Stiffness) {
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
    for line in stiffness(&report.stiffness, file) {
        tell!("{line}");
    }
    tell_verdict(report);
}

/// Returns what the swing of the ball says about the cables, and what to write into the rig file,
/// which says that they have the stiffness `file`.
fn stiffness(measured: &Measurement, file: Stiffness) -> Vec<String> {
    let finding = match measured {
        Measurement::Unknown(Doubt::Fault) => return Vec::new(),
        Measurement::Unknown(doubt) => {
            format!("the stiffness of the cables could not be told: {doubt}")
        }
        Measurement::Stiff { period_s: None } => {
            "the ball does not swing on its cables: they are stiff".to_owned()
        }
        Measurement::Stiff { period_s: Some(period) } | Measurement::Soft { period_s: period } => {
            let kind = measured.proposal().unwrap_or_default().name();
            format!("the ball swings on its cables once in {period:.2} s: they are {kind}")
        }
    };
    let advice = match (measured.proposal(), file) {
        (None, Stiffness::Unknown) => Some(
            "in [cables] of the rig file, `stiffness` is \"stiff\" for steel wire or braided line, \
             \"soft\" for nylon or elastic line"
                .to_owned(),
        ),
        (Some(Stiffness::Soft), Stiffness::Stiff) => Some(
            "warning: the rig file says that the cables are stiff, and a cable can go slack. Write \
             `stiffness = \"soft\"` into [cables] of the rig file"
                .to_owned(),
        ),
        (Some(proposal), file) if proposal != file => {
            let name = proposal.name();
            Some(format!("proposal: write `stiffness = {name:?}` into [cables] of the rig file"))
        }
        _ => None,
    };
    std::iter::once(finding).chain(advice).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_too_bold_is_warned_about_and_the_others_get_a_proposal() {
        let soft = Measurement::Soft { period_s: 0.4 };
        let last = |measured, file| stiffness(&measured, file).pop().unwrap();
        assert!(last(soft, Stiffness::Stiff).starts_with("warning: "));
        assert!(last(soft, Stiffness::Unknown).contains("`stiffness = \"soft\"`"));
        assert!(last(soft, Stiffness::Soft).ends_with("once in 0.40 s: they are soft"));
        for period_s in [None, Some(0.1)] {
            let stiff = Measurement::Stiff { period_s };
            assert!(last(stiff, Stiffness::Unknown).contains("`stiffness = \"stiff\"`"));
            assert!(last(stiff, Stiffness::Soft).contains("`stiffness = \"stiff\"`"));
            assert!(last(stiff, Stiffness::Stiff).ends_with("they are stiff"));
        }
    }

    #[test]
    fn a_doubt_proposes_nothing() {
        let noise = Measurement::Unknown(Doubt::Noise);
        for file in [Stiffness::Stiff, Stiffness::Soft] {
            let lines = stiffness(&noise, file);
            assert_eq!(lines.len(), 1, "{lines:?}");
            assert!(lines[0].contains("could not be told: the swing is too small"), "{lines:?}");
        }
        assert!(stiffness(&noise, Stiffness::Unknown)[1].contains("steel wire or braided line"));
        assert!(stiffness(&Measurement::Unknown(Doubt::Fault), Stiffness::Stiff).is_empty());
    }
}
