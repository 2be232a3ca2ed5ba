//! Camera file (TOML): intrinsics and pose of a camera, and the ball.

use std::fmt;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use plumb_config::bounded_read::read_text;
use plumb_config::mistake::Mistake;
use plumb_config::quantity::{
    BallDiameter, Coordinate, DepthUnits, DistortionCoefficient, FocalLength, Hue, PixelCoordinate,
    some_pixels,
};
use plumb_config::toml_file::{MAX_BYTES, TomlFileError, diagnose, parse_toml, place};
use plumb_frame::camera::{
    CalibratedFor, Camera, Distortion, DistortionCoefficients, DistortionError, Intrinsics,
};
use plumb_frame::image::ImageSize;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use thiserror::Error;

/// Text of the paper's camera file, `rigs/camera.toml`.
pub const PAPER: &str = include_str!("../../rigs/camera.toml");

/// Reference page of the camera file: every key with its unit, range, default and meaning.
pub const REFERENCE: &str = include_str!("../../../docs/use/camera-file.md");

/// Keys of the table `[intrinsics]` for the distortion of the lens, in OpenCV's order.
pub const DISTORTION_KEYS: [&str; 5] = ["k1", "k2", "p1", "p2", "k3"];

/// Values with which [`mistakes`] goes on where the file has a mistake.
const PLACEHOLDERS: &str = "\
intrinsics = { fx = 1, fy = 1, cx = 0, cy = 0, depth_scale = 1 }
pose = { translation = [0, 0, 0], quaternion = [0, 0, 0, 1] }
ball = { diameter_m = 1 }
";

/// Returns all mistakes in the text of a camera file.
pub fn mistakes(text: &str) -> Vec<Mistake> {
    diagnose::<CameraFile>(text, PLACEHOLDERS).mistakes
}

/// Reads the camera file at `path`:
///
/// ```toml
/// [intrinsics]            # pixels; depth_scale: depth units in a metre
/// width = 640             # of the pictures that they belong to; may be left out with the height
/// height = 480
/// fx = 525.0
/// fy = 525.0
/// cx = 319.5
/// cy = 239.5
/// depth_scale = 5000.0
/// k1 = -0.1               # distortion of the lens: k1, k2, p1, p2, k3, each 0 by default
/// [pose]                  # camera axes (x right, y down, z forward) into the rig frame
/// translation = [1.737, 0.286, 0.225]     # metres
/// quaternion = [-0.5, -0.5, 0.5, 0.5]     # x, y, z, w
/// [ball]
/// diameter_m = 0.06
/// hue = 0.0               # degrees: 0 red (the default), 120 green, 240 blue
/// ```
///
/// # Errors
/// Where the file cannot be read, has an unknown key, lacks a key, or a value is out of its type's
/// range; where the quaternion's norm is not within 1 % of 1 (it is normalised), or the distortion
/// has no inverse over the whole picture. Without `width` and `height` the principal point is taken
/// for its middle.
pub fn read(path: &Path) -> Result<Camera, TomlFileError> {
    parse(path, &read_text(path, MAX_BYTES)?)
}

/// Parses the text of the camera file at `path`, as [`read`]. The file is not read; errors name it.
///
/// # Errors
/// Where the contents are invalid.
pub fn parse(path: &Path, text: &str) -> Result<Camera, TomlFileError> {
    parse_toml::<CameraFile>(path, text).map(Camera::from).map_err(|error| {
        match is_rig_file(text) {
            true => TomlFileError::OtherKind {
                path: path.to_owned(),
                found: "a rig file",
                wanted: "the camera file",
            },
            false => error,
        }
    })
}

/// Returns whether a text is that of a camera file: whether it has tables that only such a file
/// has.
pub fn is_camera_file(text: &str) -> bool {
    has_key(text, &CAMERA_TABLES) && !has_key(text, &RIG_TABLES)
}

/// Returns whether a text is that of a rig file: whether it has tables that only such a file has.
pub fn is_rig_file(text: &str) -> bool {
    has_key(text, &RIG_TABLES) && !has_key(text, &CAMERA_TABLES)
}

/// Tables that only a camera file has.
const CAMERA_TABLES: [&str; 2] = ["intrinsics", "pose"];

/// Tables that only a rig file has.
const RIG_TABLES: [&str; 3] = ["board", "motors", "workspace"];

fn has_key(text: &str, keys: &[&str]) -> bool {
    // A text without the word is not parsed: a list of places may be long.
    keys.iter().any(|key| text.contains(key) && place(text, key).is_some())
}

/// Returns the paper's camera, `rigs/camera.toml`: at (1.737, 0.286, 0.225) m, looking along -x.
///
/// # Errors
/// None in a released program: the file is compiled in, and a test parses it.
pub fn paper() -> Result<Camera, TomlFileError> {
    parse(Path::new("rigs/camera.toml"), PAPER)
}

/// Contents of a camera file. Every key is required but those of the distortion, the size of the
/// pictures, and `ball.hue`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    intrinsics: CheckedIntrinsics,
    pose: PoseTable,
    ball: BallTable,
}

/// Table `[pose]`: a [`Pose`], and what is known of the ball's place.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseTable {
    translation: [Coordinate; 3],
    quaternion: Rotation,
    /// Whether the ball stays in the plane x = 0 of the rig frame. Default: false.
    #[serde(default)]
    planar: bool,
}

/// Pose of a camera: camera axes (x right, y down, z forward) in the rig frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position of the camera in the rig frame, metres.
    translation: [Coordinate; 3],
    /// Rotation from camera axes into the rig frame: x, y, z, w; norm 1 within 1 %.
    quaternion: Rotation,
}

impl Pose {
    /// Returns the pose as the transformation from camera axes into the rig frame, metres.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x, y, z] = self.translation.map(Coordinate::get);
        Isometry3::from_parts(Translation3::new(x, y, z), self.quaternion.0)
    }
}

/// What to do where pictures do not show the ball, for messages.
pub const COMPARE_BALL: &str =
    "compare [ball] of the camera file with the ball (diameter and hue), and look at the light";

/// Table `[ball]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BallTable {
    /// Diameter, metres, 0.001 to 10.
    diameter_m: BallDiameter,
    /// Hue, degrees, 0 to 360. Default: 0, red.
    #[serde(default)]
    hue: Hue,
}

/// Rotation, written as the quaternion [x, y, z, w].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "[f64; 4]")]
struct Rotation(UnitQuaternion<f64>);

/// Quaternion whose norm is not 1.
#[derive(Debug, Error)]
#[error("the quaternion [x, y, z, w] has norm {0}, a rotation's is 1")]
struct NormError(f64);

/// Largest deviation of a quaternion's norm from 1, for numbers that were rounded.
const NORM_TOLERANCE: f64 = 0.01;

impl TryFrom<[f64; 4]> for Rotation {
    type Error = NormError;

    fn try_from([x, y, z, w]: [f64; 4]) -> Result<Self, NormError> {
        let q = Quaternion::new(w, x, y, z);
        let norm = q.norm();
        if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
            return Err(NormError(norm));
        }
        Ok(Self(UnitQuaternion::from_quaternion(q)))
    }
}

impl From<CameraFile> for Camera {
    fn from(file: CameraFile) -> Self {
        let PoseTable { translation, quaternion, planar } = file.pose;
        Self {
            intrinsics: file.intrinsics.intrinsics,
            calibrated_for: file.intrinsics.calibrated_for,
            pose: Pose { translation, quaternion }.isometry(),
            ball_diameter: file.ball.diameter_m.get(),
            ball_hue: file.ball.hue.get(),
            is_planar: planar,
        }
    }
}

/// Value of `intrinsics.depth_scale` of a camera without depth.
pub const NO_DEPTH: &str = "none";

/// Table `[intrinsics]` with a distortion that can be inverted.
#[derive(Debug, Deserialize)]
#[serde(try_from = "IntrinsicsTable")]
struct CheckedIntrinsics {
    intrinsics: Intrinsics,
    calibrated_for: CalibratedFor,
}

/// Mistake in the table `[intrinsics]`.
#[derive(Debug, Error)]
enum IntrinsicsError {
    /// The size of the pictures is stated by half.
    #[error("width and height belong together: state both or none")]
    HalfSize,
    /// The principal point is outside of pictures of the stated size.
    #[error("the principal point ({cx}, {cy}) is not in a picture of {size}")]
    Outside { cx: f64, cy: f64, size: ImageSize },
    /// The distortion cannot be inverted.
    #[error(transparent)]
    Distortion(#[from] DistortionError),
}

impl TryFrom<IntrinsicsTable> for CheckedIntrinsics {
    type Error = IntrinsicsError;

    fn try_from(table: IntrinsicsTable) -> Result<Self, IntrinsicsError> {
        let (intrinsics, size) = (table.intrinsics(), table.size()?);
        let Intrinsics { cx, cy, .. } = intrinsics;
        let calibrated_for = size.map_or(CalibratedFor::Unstated, CalibratedFor::Size);
        let is_outside = |size: &ImageSize| {
            let is_within = |point: f64, pixels| (0.0..pixels as f64).contains(&point);
            !(is_within(cx, size.width) && is_within(cy, size.height))
        };
        if let Some(size) = size.filter(is_outside) {
            return Err(IntrinsicsError::Outside { cx, cy, size });
        }
        // Where the file does not state it, the size is guessed. Each source checks its own.
        let guess = || {
            let [width, height] = [cx, cy].map(|middle| (2.0 * middle + 1.0).round() as usize);
            ImageSize { width, height }
        };
        let ImageSize { width, height } = size.unwrap_or_else(guess);
        intrinsics.check_distortion(width, height)?;
        Ok(Self { intrinsics, calibrated_for })
    }
}

/// Table `[intrinsics]`: pinhole camera with the distortion of its lens, of the colour image.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct IntrinsicsTable {
    /// Columns of the pictures that the intrinsics belong to, with `height`. Default: not stated.
    #[serde(default, deserialize_with = "some_pixels")]
    width: Option<u16>,
    /// Rows of these pictures.
    #[serde(default, deserialize_with = "some_pixels")]
    height: Option<u16>,
    /// Focal length along the rows, pixels, 1 to 1e6.
    fx: FocalLength,
    /// Focal length along the columns, pixels, 1 to 1e6.
    fy: FocalLength,
    /// Column of the principal point, pixels from the centre of the leftmost pixel.
    cx: PixelCoordinate,
    /// Row of the principal point, pixels from the centre of the topmost pixel.
    cy: PixelCoordinate,
    /// Depth units in a metre, 1 to 1e6, or "none" for a camera without depth. A live camera with
    /// depth and an `.oni` file state their own.
    depth_scale: DepthScale,
    /// Radial distortion, of r². Default of this and the following: 0.
    #[serde(default)]
    k1: DistortionCoefficient,
    /// Radial distortion, of r⁴.
    #[serde(default)]
    k2: DistortionCoefficient,
    /// Tangential distortion.
    #[serde(default)]
    p1: DistortionCoefficient,
    /// Tangential distortion.
    #[serde(default)]
    p2: DistortionCoefficient,
    /// Radial distortion, of r⁶.
    #[serde(default)]
    k3: DistortionCoefficient,
}

impl IntrinsicsTable {
    /// Returns the size of the pictures, if it is stated.
    fn size(&self) -> Result<Option<ImageSize>, IntrinsicsError> {
        match (self.width, self.height) {
            (Some(width), Some(height)) => {
                let [width, height] = [width, height].map(usize::from);
                Ok(Some(ImageSize { width, height }))
            }
            (None, None) => Ok(None),
            (Some(_), None) | (None, Some(_)) => Err(IntrinsicsError::HalfSize),
        }
    }

    /// Returns the intrinsics, not checked.
    fn intrinsics(&self) -> Intrinsics {
        let coefficients = [&self.k1, &self.k2, &self.p1, &self.p2, &self.k3].map(|k| k.get());
        Intrinsics {
            fx: self.fx.get(),
            fy: self.fy.get(),
            cx: self.cx.get(),
            cy: self.cy.get(),
            depth_scale: self.depth_scale.units(),
            distortion: Distortion::new(DistortionCoefficients::from_array(coefficients)),
        }
    }
}

/// Depth units in a metre.
#[derive(Debug)]
enum DepthScale {
    /// The camera has no depth.
    None,
    /// Units in a metre.
    Units(DepthUnits),
}

impl DepthScale {
    /// Returns the units in a metre; 0 without depth.
    fn units(&self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Units(units) => units.get(),
        }
    }
}

impl<'de> Deserialize<'de> for DepthScale {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DepthScaleVisitor)
    }
}

/// Reader of a [`DepthScale`]: a number or a name.
struct DepthScaleVisitor;

impl Visitor<'_> for DepthScaleVisitor {
    type Value = DepthScale;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, or `{NO_DEPTH}` for a camera without depth", DepthUnits::RANGE)
    }

    fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<DepthScale, E> {
        DepthUnits::try_from(x).map(DepthScale::Units).map_err(E::custom)
    }

    fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<DepthScale, E> {
        self.visit_f64(x as f64)
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<DepthScale, E> {
        if name == NO_DEPTH {
            return Ok(DepthScale::None);
        }
        Err(E::invalid_value(Unexpected::Str(name), &self))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_frame::camera::CalibratedFor;
    use plumb_frame::image::ImageSize;

    use super::*;

    const GOOD: &str = "\
[intrinsics]
fx = 525.0
fy = 524
cx = 319.5
cy = 239.5
depth_scale = 5000
[pose]
translation = [1.0, 2.0, 3.0]
quaternion = [-0.5, -0.5, 0.501, 0.5]
[ball]
diameter_m = 0.06
";

    fn read_text(text: &str) -> Result<Camera, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    #[test]
    fn camera_axes_are_mapped_into_the_rig_frame() {
        let camera = read_text(GOOD).unwrap();
        assert_eq!(camera.intrinsics.fy, 524.0);
        assert_eq!(camera.ball_diameter, 0.06);
        assert_eq!(camera.ball_hue, 0.0);
        assert_eq!(read_text(&GOOD.replace("0.06", "0.06\nhue = 120")).unwrap().ball_hue, 120.0);
        // This camera looks along -x with its rows pointing down: right is +y, down is -z.
        let p = camera.pose * camera.intrinsics.deproject(319.5, 239.5, 0.5);
        assert!((p - Point3::new(0.5, 2.0, 3.0)).norm() < 2e-3, "{p}");
        let q = camera.pose * Point3::new(0.0, 1.0, 0.0);
        assert!((q - Point3::new(1.0, 2.0, 2.0)).norm() < 2e-3, "{q}");
    }

    #[test]
    fn the_size_of_the_pictures_may_be_stated() {
        assert_eq!(read_text(GOOD).unwrap().calibrated_for, CalibratedFor::Unstated);
        let stated = GOOD.replace("fx = 525.0", "width = 640\nheight = 480\nfx = 525.0");
        let size = ImageSize { width: 640, height: 480 };
        assert_eq!(read_text(&stated).unwrap().calibrated_for, CalibratedFor::Size(size));
    }

    #[test]
    fn a_camera_without_depth_has_a_depth_scale_of_none() {
        assert!(read_text(GOOD).unwrap().intrinsics.has_depth());
        let camera = read_text(&GOOD.replace("= 5000", "= 'none'")).unwrap();
        assert!(!camera.intrinsics.has_depth());
    }

    #[test]
    fn mistakes_are_reported_with_file_line_and_key() {
        let cases = [
            ("fx = 525.0", "fx = -525.0", "camera.toml:2: ", "intrinsics.fx"),
            ("depth_scale = 5000", "depth_scale = nan", "camera.toml:6: ", "depth_scale"),
            ("depth_scale = 5000", "depth_scale = 0", "camera.toml:6: ", "depth_scale"),
            ("depth_scale = 5000", "depth_scale = 'no'", "camera.toml:6: ", "or `none` for"),
            ("cx = 319.5\n", "", "camera.toml:1: ", "cx"),
            ("cx = 319.5", "cx = 319.5\nk4 = 0.1", "camera.toml:5: ", "k4"),
            ("cx = 319.5", "cx = 319.5\nk1 = nan", "camera.toml:5: ", "k1"),
            ("cx = 319.5", "cx = 319.5\nk1 = -0.6", "camera.toml:1: ", "no inverse at column"),
            ("fx = 525.0", "width = 640\nfx = 525.0", "camera.toml:1: ", "width and height"),
            ("fx = 525.0", "width = 0\nfx = 525.0", "camera.toml:2: ", "width"),
            (
                "fx = 525.0",
                "width = 300\nheight = 480\nfx = 525.0",
                "camera.toml:1: ",
                "(319.5, 239.5) is not in a picture of 300x480",
            ),
            ("0.501", "0.6", "camera.toml:9: ", "quaternion"),
            ("[ball]\ndiameter_m = 0.06\n", "", "camera.toml:9: ", "ball"),
            ("diameter_m = 0.06", "diameter_m = 0", "camera.toml:11: ", "ball.diameter_m"),
            ("diameter_m = 0.06", "diameter_m = 0.06\nhue = -10", "camera.toml:12: ", "hue"),
            ("diameter_m = 0.06", "diameter_m = 0.06\nhue = nan", "camera.toml:12: ", "hue"),
            ("[1.0, 2.0, 3.0]", "[1.0, 2.0, inf]", "camera.toml:8: ", "translation"),
        ];
        for (from, to, place, key) in cases {
            assert!(GOOD.contains(from));
            let error = read_text(&GOOD.replace(from, to)).unwrap_err();
            assert!(error.contains(place), "{place} in {error}");
            assert!(error.contains(key), "{key} in {error}");
        }
    }
}
