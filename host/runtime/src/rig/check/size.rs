//! Plausibility of a rig file: workspace and travel against the rough size of the rig.

use nalgebra::Point3;

use crate::rig::document::{Document, Finding, Severity};
use crate::rig::quantity::{Corner, TravelLimit};
use crate::rig::size::RoughSize;
use crate::rig::{CABLE_PER_TURN_RANGE_M, FULL_STEPS_PER_REVOLUTION, Rig, Simulation};
use crate::rounding::round;

/// Travel beyond which the limits protect little, in multiples of what the workspace takes.
const LARGEST_TRAVEL: f64 = 2.0;

/// Speed of a cable above which the board may ignore the ball's position as an outlier, m/s: 25 mm
/// (`MAX_MOVE_UM` of firmware/core/src/servo/tracker.rs) at 30 pictures/s.
const FASTEST_CABLE_M_S: f64 = 0.75;

/// Largest speed of a ball over that of its fastest cable: at 84° to the motion.
const FASTEST_BALL: f64 = 10.0;

/// Largest difference of the cable of a step from that of the simulated drums, as a share.
const LARGEST_DIFFERENCE: f64 = 0.2;

/// Returns the warnings about the places of a rig of this rough size.
pub(super) fn findings(document: &Document<'_>, rig: &Rig) -> Vec<Finding> {
    let warning = |keys: &[&str], problem: &str| document.finding(Severity::Warning, keys, problem);
    let Some(size) = rig.rough_size() else {
        let problem = "is missing: without the rough size of the rig, nothing compares the \
                       workspace and the travel with it";
        return vec![warning(&["size"], problem)];
    };
    let mut found = Vec::new();
    if !size.is_in_rig_frame() {
        let problem = "is not as the rig frame demands: y_B < y_C < y_A, and C at smaller x than \
                       A and B. If the motors do stand so, the ball is driven away from its \
                       target; if not, correct these places";
        found.push(warning(&[size.key], problem));
    }
    found.extend(workspace_warnings(document, rig, &size));
    let cable = cable_warning(document, rig);
    // A wrong cable of a step makes wrong steps of every length.
    if cable.is_none() {
        found.extend(travel_warning(document, rig, &size));
        found.extend(rate_warning(document, rig, &size));
        found.extend(reach_warnings(document, rig, &size));
    }
    found.extend(cable);
    found
}

/// Returns the warning about a cable of a step that no drum winds, or that is not the simulated
/// drums'.
fn cable_warning(document: &Document<'_>, rig: &Rig) -> Option<Finding> {
    let cable = rig.size.as_ref()?.cable_per_step.get();
    let simulated = rig.simulation.as_ref().map(Simulation::cable_per_step);
    let unlike = simulated.filter(|own| (cable / own - 1.0).abs() > LARGEST_DIFFERENCE);
    let is_beyond_drums = cable > CABLE_PER_TURN_RANGE_M[1] / FULL_STEPS_PER_REVOLUTION;
    let problem = if is_beyond_drums && (simulated.is_none() || unlike.is_some()) {
        let step = round(cable / FULL_STEPS_PER_REVOLUTION, 1e9);
        format!(
            "is the cable of one full step, and no drum winds so much: divide that of a turn by \
             the full steps of a turn; with {FULL_STEPS_PER_REVOLUTION} it is {step}"
        )
    } else {
        let own = round(unlike?, 1e6);
        format!(
            "is not that of the simulated drums: by `simulation.pulley_radii` a step winds {own} m"
        )
    };
    Some(document.finding(Severity::Warning, &["size.cable_per_step"], problem))
}

fn workspace_warnings(document: &Document<'_>, rig: &Rig, size: &RoughSize) -> Vec<Finding> {
    let warning = |keys: &[&str], problem: &str| document.finding(Severity::Warning, keys, problem);
    let mut found = Vec::new();
    if !corners(rig).iter().all(|corner| size.contains(*corner)) {
        let problem = "reaches outside the triangle of the motors, where a cable is slack";
        found.push(warning(&["workspace.min", "workspace.max"], problem));
    }
    if rig.workspace.min[2].get() < size.floor {
        let problem = format!("reaches below the floor, z = {} m", size.floor);
        found.push(warning(&["workspace.min"], &problem));
    }
    let lowest = size.motors.iter().map(|motor| motor.z).fold(f64::INFINITY, f64::min);
    if rig.workspace.max[2].get() >= lowest {
        let problem = format!("reaches up to the motors, z = {lowest} m, where no cable can lift");
        found.push(warning(&["workspace.max"], &problem));
    }
    found
}

fn travel_warning(document: &Document<'_>, rig: &Rig, size: &RoughSize) -> Option<Finding> {
    let [min, max] = rig.motors.travel.map(TravelLimit::get);
    let needed = size.steps_across(&corners(rig)).ceil();
    let span = max - min;
    // Both ways from anywhere in the workspace.
    let problem = if span > LARGEST_TRAVEL * 2.0 * needed {
        format!("protects little: the workspace takes at most {needed} steps of a cable either way")
    } else if span < needed {
        format!(
            "is too little to cross the workspace: that takes up to {needed} steps of a cable, and \
             as many either way from an unknown place"
        )
    } else {
        return None;
    };
    Some(document.finding(Severity::Warning, &["motors.travel"], problem))
}

fn rate_warning(document: &Document<'_>, rig: &Rig, size: &RoughSize) -> Option<Finding> {
    let speed = rig.motors.max_rate.get() * size.cable_per_step;
    (speed > FASTEST_CABLE_M_S).then(|| {
        let largest = (FASTEST_CABLE_M_S / size.cable_per_step).floor();
        let problem = format!(
            "lets a cable move at {speed:.2} m/s: above {FASTEST_CABLE_M_S} m/s, here {largest} \
             full steps/s, the ball moves more than 25 mm between two pictures at 30 a second, and \
             the board may ignore its position as an outlier"
        );
        document.finding(Severity::Warning, &["motors.max_rate"], problem)
    })
}

/// Returns the warnings about limits that this rig can never reach, so that they protect nothing.
fn reach_warnings(document: &Document<'_>, rig: &Rig, size: &RoughSize) -> Vec<Finding> {
    let across = size.steps_across(&corners(rig)).ceil();
    let steps = [
        ("following.turn", rig.following.turn.get()),
        ("jog.max_distance", rig.jog.max_distance.get()),
    ];
    let too_far = steps.into_iter().filter(|(_, steps)| *steps > across).map(|(key, _)| {
        let problem =
            format!("protects nothing: {across} full steps wind a cable across the workspace");
        document.finding(Severity::Warning, &[key], problem)
    });
    let cable = rig.motors.max_rate.get() * size.cable_per_step;
    let is_too_fast = rig.path.max_speed.get() > FASTEST_BALL * cable;
    let too_fast = is_too_fast.then(|| {
        let problem =
            format!("protects nothing: by `motors.max_rate` a cable moves at {cable:.2} m/s");
        document.finding(Severity::Warning, &["path.max_speed", "motors.max_rate"], problem)
    });
    too_far.chain(too_fast).collect()
}

/// Returns the corners of the workspace.
fn corners(rig: &Rig) -> [Point3<f64>; 8] {
    let (min, max) = (rig.workspace.min.map(Corner::get), rig.workspace.max.map(Corner::get));
    std::array::from_fn(|corner| {
        Point3::from([0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { min } else { max }[axis]))
    })
}
