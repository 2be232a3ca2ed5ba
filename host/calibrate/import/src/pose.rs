//! Pose of a camera.

use nalgebra::Isometry3;

/// Pose of a camera in the frame of a robot's base.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedPose {
    /// Camera axes (x right, y down, z forward) into the frame of the base, metres.
    pub pose: Isometry3<f64>,
    /// Name of the frame of the base. It must be the rig frame.
    pub base: String,
    /// Name of the frame of the camera.
    pub camera: String,
}
