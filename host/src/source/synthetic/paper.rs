//! The rig of the paper, for tests: Blanchini et al., "Model-free cable robot control", IFAC
//! PapersOnLine 56-2 (2023) 550-555.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};
use plumb_vision::camera::{Camera, Intrinsics};

/// Where the cables leave motors A, B and C of the paper's rig, metres in the rig frame.
pub(crate) const PAPER_MOTORS: [Point3<f64>; 3] = [
    Point3::new(0.850, 0.610, 0.665),
    Point3::new(0.850, 0.0, 0.665),
    Point3::new(0.0, 0.240, 0.665),
];

/// The paper's camera: at (1.737, 0.286, 0.225) m, looking along -x, with the intrinsics of a
/// Carmine or Kinect at 640x480, depth in millimetres, and a ball of 80 mm.
pub(crate) fn paper_camera() -> Camera {
    // Columns: where the camera's right, down and forward point in the rig frame.
    let axes = Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Camera {
        intrinsics: Intrinsics { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5, depth_scale: 1000.0 },
        pose: Isometry3::from_parts(Translation3::new(1.737, 0.286, 0.225), rotation),
        ball_diameter: 0.08,
        ball_hue: 0.0,
    }
}
