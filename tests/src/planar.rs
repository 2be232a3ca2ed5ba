//! The paper's rig with motors A and B alone, and its ball in the plane x = 0.

use nalgebra::Point3;
use plumb_emulator::plant::{Geometry, Task};
use plumb_runtime::rig::{LawName, Rig};

/// Laws for two motors.
pub const LAWS: [LawName; 3] = [LawName::Interval, LawName::Sign, LawName::Adaptive];

/// Gain of law `interval`, 1/s.
const GAMMA: f64 = 100.0;

/// Returns the task of the paper in the plane.
///
/// # Panics
/// Never: the motors are apart.
pub fn planar_task() -> Task {
    let motors = [Point3::new(0.0, 0.610, 0.665), Point3::new(0.0, 0.0, 0.665)];
    Task {
        geometry: Geometry::planar(motors, [0.015; 2]).expect("motors apart"),
        start: Point3::new(0.0, 0.220, 0.459),
        target: Point3::new(0.0, 0.400, 0.150),
    }
}

/// Returns the paper's rig file with two motors, a workspace and a target in the plane, and this
/// law.
///
/// # Panics
/// If a value is out of the rig file's range.
pub fn planar_rig(law: LawName) -> Rig {
    let paper = Rig::paper().expect("the paper's rig file");
    let mut rig = Rig { law: law.into(), simulation: None, ..paper };
    if law == LawName::Interval {
        rig.law.set_gamma(GAMMA).expect("a gain");
    }
    (rig.motors.count, rig.motors.reversed) = (2, None);
    for corner in [&mut rig.workspace.min, &mut rig.workspace.max] {
        corner[0] = 0.0.try_into().expect("a corner");
    }
    rig.set_targets(&[planar_task().target.into()]).expect("a target");
    rig
}
