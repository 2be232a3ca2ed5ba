//! Messages of `geometry_msgs` and `tf2_msgs`.

use nalgebra::{Isometry3, Point3};
use plumb_frame::observation::Gaussian3;
use serde::{Deserialize, Serialize};

use super::Header;

/// `geometry_msgs/Point` and `geometry_msgs/Vector3`, metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Vector {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
}

impl From<Point3<f64>> for Vector {
    fn from(point: Point3<f64>) -> Self {
        Self { x: point.x, y: point.y, z: point.z }
    }
}

impl From<Vector> for Point3<f64> {
    fn from(vector: Vector) -> Self {
        Self::new(vector.x, vector.y, vector.z)
    }
}

/// `geometry_msgs/PointStamped`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PointStamped {
    pub(crate) header: Header,
    pub(crate) point: Vector,
}

/// `geometry_msgs/Quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quaternion {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
    pub(crate) w: f64,
}

impl Quaternion {
    /// Rotation by nothing.
    pub(crate) const IDENTITY: Self = Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
}

/// `geometry_msgs/Pose`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pose {
    pub(crate) position: Vector,
    pub(crate) orientation: Quaternion,
}

/// `geometry_msgs/PoseWithCovarianceStamped`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseWithCovarianceStamped {
    pub(crate) header: Header,
    pub(crate) pose: PoseWithCovariance,
}

/// `geometry_msgs/PoseWithCovariance`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseWithCovariance {
    pub(crate) pose: Pose,
    /// Rows of x, y, z (square metres) and of the rotations about them (square radians).
    pub(crate) covariance: [[f64; 6]; 6],
}

/// Variance of an angle that nothing measures: that of a uniform distribution over a turn, square
/// radians.
const UNKNOWN_ANGLE: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;

impl From<&Gaussian3> for PoseWithCovariance {
    /// Returns the pose of a ball: nothing measures its orientation.
    fn from(position: &Gaussian3) -> Self {
        let covariance = std::array::from_fn(|row| {
            std::array::from_fn(|column| match (row < 3, column < 3) {
                (true, true) => position.covariance[(row, column)],
                _ if row == column => UNKNOWN_ANGLE,
                _ => 0.0,
            })
        });
        let pose = Pose { position: position.mean.into(), orientation: Quaternion::IDENTITY };
        Self { pose, covariance }
    }
}

/// `geometry_msgs/Transform`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transform {
    pub(crate) translation: Vector,
    pub(crate) rotation: Quaternion,
}

impl Transform {
    /// Returns the transform of axes at `point` that are parallel to their parent's.
    pub(crate) fn to_point(point: Point3<f64>) -> Self {
        Self { translation: point.into(), rotation: Quaternion::IDENTITY }
    }
}

impl From<&Isometry3<f64>> for Transform {
    fn from(pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation;
        Self {
            translation: Point3::from(pose.translation.vector).into(),
            rotation: Quaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w },
        }
    }
}

/// `geometry_msgs/TransformStamped`: pose of the child frame in the frame of the header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TransformStamped {
    pub(crate) header: Header,
    pub(crate) child_frame_id: String,
    pub(crate) transform: Transform,
}

/// `tf2_msgs/TFMessage`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TfMessage {
    pub(crate) transforms: Vec<TransformStamped>,
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn the_covariance_of_the_position_is_the_upper_left_block() {
        let covariance = Matrix3::new(4e-6, 1e-6, 0.0, 1e-6, 5e-6, 2e-6, 0.0, 2e-6, 9e-6);
        let position = Gaussian3 { mean: Point3::new(0.4, 0.3, 0.2), covariance };
        let pose = PoseWithCovariance::from(&position);
        let got = Matrix3::from_fn(|row, column| pose.covariance[row][column]);
        assert_eq!(got, covariance);
        assert_eq!(pose.covariance[3], [0.0, 0.0, 0.0, UNKNOWN_ANGLE, 0.0, 0.0]);
        assert_eq!(pose.pose.position, Vector { x: 0.4, y: 0.3, z: 0.2 });
    }

    #[test]
    fn a_transform_takes_points_of_the_child_into_the_parent() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.1);
        let pose = Isometry3::from_parts(Vector3::new(1.7, 0.3, 0.2).into(), turn);
        let Transform { translation, rotation } = Transform::from(&pose);
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            rotation.w, rotation.x, rotation.y, rotation.z,
        ));
        let point = Point3::new(0.1, -0.2, 1.5);
        let got = rotation * point + Point3::from(translation).coords;
        assert!((got - pose * point).norm() < 1e-12, "{got}");
    }
}
