//! The text of a camera file with another pose or lens. Everything else stays as it is.

use nalgebra::Isometry3;
use plumb_cameras::camera_file::DISTORTION_KEYS;
use plumb_config::toml_text::{TomlError, TomlText};
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::ImageSize;
use thiserror::Error;

/// Reason why the pose of a camera file's text could not be replaced.
#[derive(Debug, Error)]
#[error("the camera file has no [pose] with translation and quaternion")]
pub struct NoPose(#[source] Option<TomlError>);

/// Reason why the intrinsics of a camera file's text could not be replaced.
#[derive(Debug, Error)]
#[error("the camera file has no [intrinsics] with fx, fy, cx and cy")]
pub struct NoIntrinsics(#[source] Option<TomlError>);

/// Returns a camera file's text with the pose `pose` (camera axes into the rig frame), its numbers
/// rounded to micrometres and 1e-8. A comment behind a replaced value, which describes the old one,
/// is replaced by `comment`; other comments and the order of keys stay.
///
/// # Errors
/// If the text is no TOML or lacks the pose.
pub fn with_pose(text: &str, pose: &Isometry3<f64>, comment: &str) -> Result<String, NoPose> {
    let mut file = TomlText::parse(text).map_err(|error| NoPose(Some(error)))?;
    let mut table = file.table("pose", Some(comment)).ok_or(NoPose(None))?;
    let t = pose.translation.vector;
    let q = pose.rotation.coords;
    let translation = format!("[{:.6}, {:.6}, {:.6}]", t.x, t.y, t.z);
    let quaternion = format!("[{:.8}, {:.8}, {:.8}, {:.8}]", q.x, q.y, q.z, q.w);
    for (key, value) in [("translation", translation), ("quaternion", quaternion)] {
        table.replace(key, &value).ok_or(NoPose(None))?;
    }
    Ok(file.text())
}

/// Returns a camera file's text with the focal lengths, the principal point and the distortion of
/// `lens`, rounded to 1e-4 pixels and 1e-8, and the `size` of the pictures that it belongs to. A
/// key of the distortion or of the size that the text lacks is added behind the others. A comment
/// behind a replaced value is replaced by `comment`; other comments, the depth scale and the order
/// of keys stay.
///
/// # Errors
/// If the text is no TOML or lacks the intrinsics.
pub fn with_lens(
    text: &str,
    (lens, size): (&Intrinsics, ImageSize),
    comment: &str,
) -> Result<String, NoIntrinsics> {
    let mut file = TomlText::parse(text).map_err(|error| NoIntrinsics(Some(error)))?;
    let mut table = file.table("intrinsics", Some(comment)).ok_or(NoIntrinsics(None))?;
    let pixels = [("fx", lens.fx), ("fy", lens.fy), ("cx", lens.cx), ("cy", lens.cy)];
    for (key, value) in pixels {
        table.replace(key, &format!("{value:.4}")).ok_or(NoIntrinsics(None))?;
    }
    let coefficients = lens.distortion.map(|it| it.coefficients()).unwrap_or_default();
    let distortion = DISTORTION_KEYS.into_iter().zip(coefficients.to_array());
    let distortion = distortion.map(|(key, value)| (key, format!("{value:.8}")));
    let size = [("width", size.width.to_string()), ("height", size.height.to_string())];
    for (key, value) in size.into_iter().chain(distortion) {
        table.set(key, &value);
    }
    Ok(file.text())
}

/// Returns a camera file's text with the pose of a camera before a plane, as [`with_pose`]. The
/// text then says that the ball stays in the plane.
///
/// # Errors
/// If the text is no TOML or lacks the pose.
pub fn with_plane(text: &str, pose: &Isometry3<f64>, comment: &str) -> Result<String, NoPose> {
    let mut file =
        TomlText::parse(&with_pose(text, pose, comment)?).map_err(|error| NoPose(Some(error)))?;
    file.table("pose", None).ok_or(NoPose(None))?.set("planar", "true");
    Ok(file.text())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::{Translation3, UnitQuaternion};
    use plumb_cameras::camera_file;
    use plumb_frame::camera::{CalibratedFor, Distortion};

    use super::*;

    const VGA: ImageSize = ImageSize { width: 640, height: 480 };

    fn pose() -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        Isometry3::from_parts(Translation3::new(1.25, -0.5, 0.123_456_7), rotation)
    }

    #[test]
    fn only_the_pose_changes() {
        let old = camera_file::PAPER;
        let new = with_pose(old, &pose(), "plumb calibrate --board").unwrap();
        let camera = camera_file::parse(Path::new("camera.toml"), &new).unwrap();
        assert!((camera.pose.to_homogeneous() - pose().to_homogeneous()).norm() < 1e-6);
        assert_eq!(camera.intrinsics, camera_file::paper().unwrap().intrinsics);
        assert!(new.contains("# plumb calibrate --board\n"), "{new}");
        // The comment on the old rotation is gone, the file's first line is not.
        assert!(!new.contains("camera x is rig y"), "{new}");
        assert_eq!(new.lines().next(), old.lines().next());
        assert_eq!(new.lines().count(), old.lines().count());
    }

    #[test]
    fn the_pose_before_a_plane_says_so() {
        let new = with_plane(camera_file::PAPER, &pose(), "two jogs").unwrap();
        let camera = camera_file::parse(Path::new("camera.toml"), &new).unwrap();
        assert!((camera.pose.to_homogeneous() - pose().to_homogeneous()).norm() < 1e-6);
        assert!(camera.is_planar && !camera_file::paper().unwrap().is_planar);
        assert_eq!(with_plane(&new, &pose(), "two jogs").unwrap(), new);
    }

    #[test]
    fn values_over_several_lines_and_windows_line_ends_are_replaced() {
        let text = "[pose]\r\nquaternion = [0,\r\n 0, # a comment\r\n 0, 1]\r\n\
                    translation = [1, 2, 3] # tape measure\r\n# end\r\n";
        let new = with_pose(text, &pose(), "new").unwrap();
        assert!(new.starts_with("[pose]\r\nquaternion = ["), "{new}");
        assert!(new.ends_with("# new\r\n# end\r\n"), "{new}");
        assert!(new.contains("translation = [1.250000, -0.500000, 0.123457]  # new\r\n"), "{new}");
    }

    #[test]
    fn a_text_without_a_pose_is_an_error() {
        assert!(with_pose("[intrinsics]\nfx = 1\n", &pose(), "").is_err());
        assert!(with_pose("[pose]\ntranslation = [1, 2, 3]\n", &pose(), "").is_err());
    }

    /// Returns the camera of a text after the lens was replaced.
    fn lens_of(text: &str, lens: &Intrinsics) -> plumb_frame::camera::Camera {
        let new = with_lens(text, (lens, VGA), "new").unwrap();
        camera_file::parse(Path::new("camera.toml"), &new).unwrap_or_else(|e| panic!("{e}: {new}"))
    }

    #[test]
    fn only_the_lens_changes() {
        let old = camera_file::paper().unwrap();
        let array = [-0.28, 0.11, 0.001, -0.002, 0.03];
        let distortion =
            Distortion::new(plumb_frame::camera::DistortionCoefficients::from_array(array));
        let lens = Intrinsics { fx: 601.5, cy: 236.25, distortion, ..old.intrinsics };
        let new = lens_of(camera_file::PAPER, &lens);
        assert_eq!(new.intrinsics, lens);
        assert_eq!((new.pose, new.ball_diameter), (old.pose, old.ball_diameter));
        // The keys are there now, and are replaced.
        assert_eq!(new.calibrated_for, CalibratedFor::Size(VGA));
        let text = with_lens(camera_file::PAPER, (&lens, VGA), "new").unwrap();
        assert_eq!(lens_of(&text, &old.intrinsics).intrinsics, old.intrinsics);
        // Dotted keys and inline tables.
        let rest = &camera_file::PAPER[camera_file::PAPER.find("[pose]").unwrap()..];
        let values = "fx = 1.0, fy = 1.0, cx = 319.5, cy = 239.5, depth_scale = 5000.0";
        let inline = format!("intrinsics = {{ {values} }}\n{rest}");
        assert_eq!(lens_of(&inline, &lens).intrinsics, lens);
        let dotted: String = values.split(", ").map(|key| format!("intrinsics.{key}\n")).collect();
        assert_eq!(lens_of(&format!("{dotted}{rest}"), &lens).intrinsics, lens);
        assert!(with_lens("[intrinsics]\nfx = 1\n", (&lens, VGA), "").is_err());
    }

    #[test]
    fn an_inline_table_is_replaced_without_comments() {
        let text = "pose = { translation = [1, 2, 3], quaternion = [0, 0, 0, 1] } # mine\n";
        let new = with_pose(text, &pose(), "new").unwrap();
        assert!(new.starts_with("pose = { translation = [1.250000,"), "{new}");
        assert!(new.ends_with("] } # mine\n"), "{new}");
    }
}
