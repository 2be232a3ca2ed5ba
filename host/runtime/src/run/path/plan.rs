//! A path that was checked against the rig.

use plumb_path::check::{Breach, check};
use plumb_path::trajectory::{Limits, Trajectory};

use crate::rig::{MotionError, Rig};

/// First place of a path that the rig does not allow.
pub type PathPlanError = Breach<MotionError>;

/// Path for a run, within what the rig file allows.
#[derive(Debug, Clone)]
pub struct PathPlan {
    trajectory: Trajectory,
    waits: bool,
}

impl PathPlan {
    /// Checks a trajectory by the rig file: workspace, triangle and rates of the motors, and the
    /// limits of the table `[path]`. Where `waits`, the path goes slower while the ball is far from
    /// it or not seen; otherwise its time goes on.
    ///
    /// # Errors
    /// The first place that the rig does not allow.
    pub fn new(trajectory: Trajectory, waits: bool, rig: &Rig) -> Result<Self, PathPlanError> {
        let rules = rig.motion_rules();
        check(&trajectory, &path_limits(rig), |at| rules.check(at.position, at.velocity))?;
        Ok(Self { trajectory, waits })
    }

    /// Returns the trajectory.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Returns whether the path goes slower while the ball cannot keep up.
    pub fn waits(&self) -> bool {
        self.waits
    }
}

/// Returns the limits of the table `[path]` of the rig file.
fn path_limits(rig: &Rig) -> Limits {
    Limits {
        speed: rig.path.max_speed.get(),
        acceleration: rig.path.max_acceleration.get(),
        jerk: rig.path.max_jerk.get(),
    }
}
