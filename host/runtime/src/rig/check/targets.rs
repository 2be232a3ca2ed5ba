//! Targets of a rig file: places where the ball cannot be, or may be stopped.

use crate::rig::document::{Document, Finding, Severity};
use crate::rig::{MotionError, Rig, WrongTarget};

/// Returns the errors of the targets: none at all, or one outside the workspace or the triangle of
/// the motors.
pub(super) fn findings(document: &Document<'_>, rig: &Rig) -> Vec<Finding> {
    if rig.targets.is_empty() && rig.plane.is_none() {
        return vec![document.out_of_range(&["targets"], "has no target")];
    }
    if let Some(finding) = no_place(document, rig) {
        return vec![finding];
    }
    let error = |WrongTarget { number, target, error }: WrongTarget| match error {
        MotionError::Workspace(outside) => {
            let problem = format!(
                "has a target outside the workspace, number {number}, {target:?}: {outside}"
            );
            let keys = ["targets", "workspace.min", "workspace.max"];
            document.finding(Severity::Error, &keys, problem)
        }
        _ => {
            let problem = format!(
                "put target {number}, {target:?}, outside the triangle of the motors: a cable is \
                 slack there"
            );
            let keys = ["targets", rig.rough_size().map_or("size.motors", |size| size.key)];
            document.finding(Severity::Error, &keys, problem)
        }
    };
    rig.wrong_targets().into_iter().map(error).collect()
}

/// Returns the error of a rig where the ball can be at no place, so that every target is wrong.
pub(super) fn no_place(document: &Document<'_>, rig: &Rig) -> Option<Finding> {
    let error = rig.wrong_targets().first()?.error;
    let (keys, problem) = match error {
        MotionError::NoRoom { axis } => (
            &["workspace.min", "workspace.max"][..],
            format!("leave no room along {axis}: `min` must be below `max` in each coordinate"),
        ),
        MotionError::Line => (
            &[rig.rough_size().map_or("size.motors", |size| size.key)][..],
            "are on a line, seen from above, and no place is between them: they must be the \
             corners of a triangle"
                .to_owned(),
        ),
        _ => return None,
    };
    Some(document.finding(Severity::Error, keys, problem))
}

/// Returns the warning about the first target at the border of the workspace, or about a radius of
/// "reached" for which every place is at the border.
pub(super) fn at_border(document: &Document<'_>, rig: &Rig) -> Option<Finding> {
    let target = rig.target_at_border(rig.target_places())?;
    let (min, max) = (rig.workspace.min, rig.workspace.max);
    let widths = min.iter().zip(&max).map(|(min, max)| max.get() - min.get());
    let room = widths.fold(f64::INFINITY, f64::min) / 2.0;
    if room < target.enough_m {
        let problem = format!(
            "is larger than the room for the ball: no place is more than {:.0} mm from the border \
             of the workspace, and the board stops if the ball swings across it",
            room * 1e3
        );
        return Some(document.finding(Severity::Warning, &["reached.radius"], problem));
    }
    let problem = format!("put target {} {target}", target.number);
    let keys = ["targets", "workspace.min", "workspace.max"];
    Some(document.finding(Severity::Warning, &keys, problem))
}
