//! Messages about the camera: picture, calibration and pose.

use foxglove::messages::{CameraCalibration, CompressedImage, FrameTransform, Quaternion, Vector3};
use nalgebra::Isometry3;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::BoxedError;
use plumb_pictures::jpeg;

use crate::clock::timestamp;

/// Name of the rig frame.
pub(crate) const RIG: &str = "rig";

/// Name of the camera's axes: x right, y down, z forward.
const CAMERA: &str = "camera";

/// Returns the colour picture as JPEG of this quality, 1 to 100.
///
/// # Errors
/// Where the picture cannot be encoded.
pub(crate) fn image(
    frame: &RgbdFrame,
    quality: u8,
    stamp: u64,
) -> Result<CompressedImage, BoxedError> {
    Ok(CompressedImage {
        timestamp: timestamp(stamp),
        frame_id: CAMERA.to_owned(),
        data: jpeg::encode(frame.colour(), quality)?.into(),
        format: "jpeg".to_owned(),
    })
}

/// Returns the intrinsics of a picture, with the distortion of the lens. Plumb's model is that of
/// the name "plumb_bob".
pub(crate) fn calibration(frame: &RgbdFrame, stamp: u64) -> CameraCalibration {
    let (colour, camera) = (frame.colour(), frame.intrinsics());
    let (fx, fy, cx, cy) = (camera.fx, camera.fy, camera.cx, camera.cy);
    let distortion = camera.distortion.map(|lens| lens.coefficients());
    CameraCalibration {
        timestamp: timestamp(stamp),
        frame_id: CAMERA.to_owned(),
        width: colour.width() as u32,
        height: colour.height() as u32,
        distortion_model: "plumb_bob".to_owned(),
        d: distortion.unwrap_or_default().to_array().to_vec(),
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

/// Returns the camera's pose in the rig frame.
pub(crate) fn transform(pose: &Isometry3<f64>, stamp: u64) -> FrameTransform {
    let (at, turn) = (pose.translation.vector, pose.rotation);
    FrameTransform {
        timestamp: timestamp(stamp),
        parent_frame_id: RIG.to_owned(),
        child_frame_id: CAMERA.to_owned(),
        translation: Some(Vector3 { x: at.x, y: at.y, z: at.z }),
        rotation: Some(Quaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w }),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};
    use plumb_cameras::camera_file;
    use plumb_frame::image::Image;

    use super::*;

    #[test]
    fn the_transform_takes_a_point_of_the_camera_into_the_rig_frame() {
        let pose = camera_file::paper().unwrap().pose;
        let message = transform(&pose, 0);
        let (at, turn) = (message.translation.unwrap(), message.rotation.unwrap());
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            turn.w, turn.x, turn.y, turn.z,
        ));
        let point = Point3::new(0.1, -0.2, 1.5);
        let there = turn * point + nalgebra::Vector3::new(at.x, at.y, at.z);
        assert!((there - pose * point).norm() < 1e-12, "{there}");
    }

    #[test]
    fn the_calibration_projects_as_the_camera_does() {
        let camera = camera_file::paper().unwrap().intrinsics;
        let (colour, depth) = (Image::filled(64, 48, [0; 3]), Image::filled(64, 48, 0));
        let frame = RgbdFrame::new(0.0, colour, depth, camera).unwrap();
        let message = calibration(&frame, 0);
        assert_eq!((message.width, message.height), (64, 48));
        let point = Point3::new(0.1, -0.2, 1.5);
        let row = |i: usize| {
            let row = &message.p[4 * i..4 * i + 4];
            row[0] * point.x + row[1] * point.y + row[2] * point.z + row[3]
        };
        let (u, v) = camera.project(&point).unwrap();
        assert!((row(0) / row(2) - u).abs() < 1e-9 && (row(1) / row(2) - v).abs() < 1e-9);
        assert_eq!(message.d, [0.0; 5]);
    }

    #[test]
    fn the_calibration_has_the_distortion_of_the_lens() {
        let coefficients = [-0.28, 0.11, 0.001, -0.002, -0.02];
        let text = "k1 = -0.28\nk2 = 0.11\np1 = 0.001\np2 = -0.002\nk3 = -0.02\ncx =";
        let text = camera_file::PAPER.replacen("cx =", text, 1);
        let camera = camera_file::parse("camera.toml".as_ref(), &text).unwrap().intrinsics;
        let (colour, depth) = (Image::filled(64, 48, [0; 3]), Image::filled(64, 48, 0));
        let frame = RgbdFrame::new(0.0, colour, depth, camera).unwrap();
        let message = calibration(&frame, 0);
        assert_eq!(message.d, coefficients);
        assert_eq!(message.distortion_model, "plumb_bob");
    }
}
