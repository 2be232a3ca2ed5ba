//! The text of a camera file with another pose or lens. Everything else stays as it is.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Isometry3;
use plumb_cameras::camera_file::DISTORTION_KEYS;
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::ImageSize;
use serde::Deserialize;
use thiserror::Error;
use toml::Spanned;

/// Reason why the pose of a camera file's text could not be replaced.
#[derive(Debug, Error)]
#[error("the camera file has no [pose] with translation and quaternion")]
pub struct NoPose(#[source] toml::de::Error);

/// The part of a camera file that is replaced.
#[derive(Deserialize)]
struct File {
    pose: Pose,
}

#[derive(Deserialize)]
struct Pose {
    translation: Spanned<[f64; 3]>,
    quaternion: Spanned<[f64; 4]>,
}

/// Returns a camera file's text with the pose `pose` (camera axes into the rig frame), its numbers
/// rounded to micrometres and 1e-8. A comment behind a replaced value, which describes the old one,
/// is replaced by `comment`; other comments and the order of keys stay.
///
/// # Errors
/// If the text is no TOML or lacks the pose.
pub fn with_pose(text: &str, pose: &Isometry3<f64>, comment: &str) -> Result<String, NoPose> {
    let old: File = toml::from_str(text).map_err(NoPose)?;
    let t = pose.translation.vector;
    let q = pose.rotation.coords;
    let translation = format!("[{:.6}, {:.6}, {:.6}]", t.x, t.y, t.z);
    let quaternion = format!("[{:.8}, {:.8}, {:.8}, {:.8}]", q.x, q.y, q.z, q.w);
    let mut edits =
        [(old.pose.translation.span(), translation), (old.pose.quaternion.span(), quaternion)];
    // From the end, so that the earlier places stay valid.
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = text.to_owned();
    for (span, value) in edits {
        match line_end(&text, &span) {
            Some(end) => text.replace_range(span.start..end, &format!("{value}  # {comment}")),
            None => text.replace_range(span, &value),
        }
    }
    Ok(text)
}

/// Reason why the intrinsics of a camera file's text could not be replaced.
#[derive(Debug, Error)]
#[error("the camera file has no [intrinsics] with fx, fy, cx and cy")]
pub struct NoIntrinsics(#[source] toml::de::Error);

/// The part of a camera file that is replaced.
#[derive(Deserialize)]
struct LensFile {
    intrinsics: BTreeMap<String, Spanned<toml::Value>>,
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
    let old: LensFile = toml::from_str(text).map_err(NoIntrinsics)?;
    let missing = |key: &str| {
        NoIntrinsics(<toml::de::Error as serde::de::Error>::custom(format!("{key} is missing")))
    };
    let pixels = [("fx", lens.fx), ("fy", lens.fy), ("cx", lens.cx), ("cy", lens.cy)];
    let (mut edits, mut added) = (Vec::new(), Vec::new());
    for (key, value) in pixels {
        let span = old.intrinsics.get(key).ok_or_else(|| missing(key))?.span();
        edits.push((span, format!("{value:.4}")));
    }
    let last = edits.iter().map(|(span, _)| span.clone()).max_by_key(|span| span.start);
    let coefficients = lens.distortion.map(|it| it.coefficients()).unwrap_or_default();
    let distortion = DISTORTION_KEYS.into_iter().zip(coefficients.to_array());
    let distortion = distortion.map(|(key, value)| (key, format!("{value:.8}")));
    let size = [("width", size.width.to_string()), ("height", size.height.to_string())];
    for (key, value) in size.into_iter().chain(distortion) {
        match old.intrinsics.get(key) {
            Some(old) => edits.push((old.span(), value)),
            None => added.push(format!("{key} = {value}")),
        }
    }
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = text.to_owned();
    for (span, value) in edits {
        let is_last = last.as_ref() == Some(&span);
        let added: &[String] = if is_last { &added } else { &[] };
        match line_end(&text, &span) {
            Some(end) => {
                let table = if is_dotted(&text, &span) { "intrinsics." } else { "" };
                let lines: String = added.iter().map(|key| format!("\n{table}{key}")).collect();
                let line = format!("{value}  # {comment}{lines}");
                text.replace_range(span.start..end, &line);
            }
            None => {
                let keys: String = added.iter().map(|key| format!(", {key}")).collect();
                text.replace_range(span, &format!("{value}{keys}"));
            }
        }
    }
    Ok(text)
}

/// Returns whether the key of a value names its table, as in `intrinsics.fx = 525.0`.
fn is_dotted(text: &str, value: &Range<usize>) -> bool {
    let line = text[..value.start].rsplit('\n').next().unwrap_or_default();
    line.trim_start().starts_with("intrinsics")
}

/// Returns the end of the line of a value if nothing but a comment is behind it. Behind a value of
/// an inline table there is more.
fn line_end(text: &str, value: &Range<usize>) -> Option<usize> {
    let line = text[value.end..].split('\n').next().unwrap_or_default().trim_end();
    (line.is_empty() || line.trim_start().starts_with('#')).then_some(value.end + line.len())
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
    fn values_over_several_lines_and_windows_line_ends_are_replaced() {
        let text = "[pose]\r\nquaternion = [0,\r\n 0, # a comment\r\n 0, 1]\r\n\
                    translation = [1, 2, 3] # tape measure\r\n# end\r\n";
        let new = with_pose(text, &pose(), "new").unwrap();
        assert!(new.starts_with("[pose]\r\nquaternion = ["), "{new}");
        assert!(new.ends_with("# new\r\n# end\r\n"), "{new}");
        let read: File = toml::from_str(&new).unwrap();
        assert_eq!(read.pose.translation.into_inner(), [1.25, -0.5, 0.123_457]);
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
