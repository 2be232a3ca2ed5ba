//! Settings of a camera, and the description of an open one.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use plumb_frame::image::ImageSize;

use crate::sys::RawIntrinsics;

/// Camera or recording to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// The first camera that is plugged in.
    First,
    /// The camera with this serial number.
    Serial(String),
    /// A recording, `.bag` or `.db3`, which is read once, picture by picture.
    Recording(PathBuf),
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::First => f.write_str("the first RealSense camera"),
            Self::Serial(serial) => f.write_str(serial),
            Self::Recording(path) => path.display().fmt(f),
        }
    }
}

/// Settings of a camera. Of a recording only the timeouts count.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Size and rate of both sensors.
    pub mode: Mode,
    /// Exposure time of the colour sensor, seconds; `None` for automatic exposure.
    pub exposure: Option<f64>,
    /// Whether to switch the infrared projector on; `None` does not change it.
    pub emitter: Option<bool>,
    /// Time from exposure to arrival of the fastest picture, seconds; see
    /// [`HostClock`](plumb_frame::clock::HostClock).
    pub latency: f64,
    /// File for the library's own recording.
    pub record: Option<PathBuf>,
    /// Time without a picture after which the camera is silent.
    pub timeout: Duration,
    /// Time limit for opening.
    pub open_timeout: Duration,
}

impl Default for Settings {
    /// Returns 640x480 at 30 Hz with automatic exposure and a latency of 45 ms, not recorded. The
    /// latency is that of the PrimeSense cameras; it has not been measured on a RealSense.
    fn default() -> Self {
        Self {
            mode: Mode { width: 640, height: 480, rate: 30 },
            exposure: None,
            emitter: None,
            latency: 0.045,
            record: None,
            timeout: Duration::from_secs(2),
            open_timeout: Duration::from_secs(15),
        }
    }
}

/// Size and rate of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mode {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Pictures per second.
    pub rate: u16,
}

impl Mode {
    /// Returns the size of the pictures.
    pub fn size(&self) -> ImageSize {
        ImageSize { width: self.width.into(), height: self.height.into() }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} at {} Hz", self.width, self.height, self.rate)
    }
}

/// Model that the coefficients of a distortion belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistortionModel {
    /// No distortion.
    None,
    /// Brown and Conrady: from the ideal to the distorted point. Coefficients k1, k2, p1, p2, k3.
    BrownConrady,
    /// As [`Self::BrownConrady`], with the tangential part computed from the radially distorted
    /// point.
    ModifiedBrownConrady,
    /// By its name the map from the distorted to the ideal point. The library computes it as
    /// [`Self::ModifiedBrownConrady`].
    InverseBrownConrady,
    /// A model of another kind, by its number in the library.
    Other(i32),
}

impl fmt::Display for DistortionModel {
    /// Writes librealsense2's name of the model.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("None"),
            Self::BrownConrady => f.write_str("Brown Conrady"),
            Self::ModifiedBrownConrady => f.write_str("Modified Brown Conrady"),
            Self::InverseBrownConrady => f.write_str("Inverse Brown Conrady"),
            Self::Other(3) => f.write_str("F-Theta"),
            Self::Other(5) => f.write_str("Kannala Brandt4"),
            Self::Other(number) => write!(f, "number {number}"),
        }
    }
}

impl DistortionModel {
    fn of(number: i32) -> Self {
        match number {
            0 => Self::None,
            1 => Self::ModifiedBrownConrady,
            2 => Self::InverseBrownConrady,
            4 => Self::BrownConrady,
            other => Self::Other(other),
        }
    }
}

/// Intrinsics of the colour picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the rows, pixels.
    pub fx: f64,
    /// Focal length along the columns, pixels.
    pub fy: f64,
    /// Column of the principal point, pixels from the centre of the leftmost pixel.
    pub cx: f64,
    /// Row of the principal point, pixels from the centre of the topmost pixel.
    pub cy: f64,
    /// Model of the distortion.
    pub model: DistortionModel,
    /// Coefficients of the distortion.
    pub coefficients: [f64; 5],
}

/// Spaces of the grid on which the largest distortion is looked for, in either direction.
const GRID: u32 = 16;

impl Intrinsics {
    /// Converts the library's form.
    pub(crate) fn of(raw: &RawIntrinsics) -> Self {
        Self {
            fx: raw.fx.into(),
            fy: raw.fy.into(),
            cx: raw.ppx.into(),
            cy: raw.ppy.into(),
            model: DistortionModel::of(raw.model),
            coefficients: raw.coefficients.map(f64::from),
        }
    }

    /// Returns the largest distance between an ideal and a distorted point in a picture of `mode`,
    /// pixels, to first order. `None` for a model of another kind with coefficients.
    pub fn largest_distortion(&self, mode: Mode) -> Option<f64> {
        if self.coefficients == [0.0; 5] || self.model == DistortionModel::None {
            return Some(0.0);
        }
        if matches!(self.model, DistortionModel::Other(_)) {
            return None;
        }
        Some(self.largest_in_picture(mode, |[x, y]| {
            let (radial, [dx, dy]) = (self.radial(x, y) - 1.0, self.tangential(x, y, 1.0));
            [x * radial + dx, y * radial + dy]
        }))
    }

    /// Returns the largest distance, pixels, between the points that
    /// [`DistortionModel::ModifiedBrownConrady`] and [`DistortionModel::BrownConrady`] give with
    /// these coefficients in a picture of `mode`, to first order.
    pub fn largest_modification(&self, mode: Mode) -> f64 {
        self.largest_in_picture(mode, |[x, y]| {
            let modified = self.tangential(x, y, self.radial(x, y));
            let plain = self.tangential(x, y, 1.0);
            [modified[0] - plain[0], modified[1] - plain[1]]
        })
    }

    /// Returns the largest length, pixels, of `shift` (focal lengths) on a grid over a picture of
    /// `mode`. `shift` takes a point in focal lengths from the principal point.
    ///
    /// The corners alone do not do: coefficients of opposite signs may cancel there.
    fn largest_in_picture(&self, mode: Mode, shift: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
        let place =
            |k: u32, pixels: u16| f64::from(k) / f64::from(GRID) * (f64::from(pixels) - 1.0);
        let columns = (0..=GRID).map(|k| place(k, mode.width));
        let points = columns.flat_map(|u| (0..=GRID).map(move |k| (u, place(k, mode.height))));
        let lengths = points.map(|(u, v)| {
            let [dx, dy] = shift([(u - self.cx) / self.fx, (v - self.cy) / self.fy]);
            (dx * self.fx).hypot(dy * self.fy)
        });
        lengths.fold(0.0, f64::max)
    }

    /// Returns the radial factor of the point (`x`, `y`).
    fn radial(&self, x: f64, y: f64) -> f64 {
        let [k1, k2, _, _, k3] = self.coefficients;
        let r2 = x * x + y * y;
        1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    }

    /// Returns the tangential shift of the point (`x`, `y`), computed from it times `factor`. The
    /// radius is that of the point itself.
    fn tangential(&self, x: f64, y: f64, factor: f64) -> [f64; 2] {
        let [_, _, p1, p2, _] = self.coefficients;
        let (r2, x, y) = (x * x + y * y, x * factor, y * factor);
        [2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y)]
    }
}

/// Description of an open camera or recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// Serial number of the camera, path of the recording.
    pub id: String,
    /// Model.
    pub name: String,
    /// Size of both pictures, and rate.
    pub mode: Mode,
    /// Length of a unit of depth, metres.
    pub depth_unit: f64,
    /// Intrinsics of the colour picture, which depth is aligned to.
    pub intrinsics: Intrinsics,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intrinsics(model: i32, coefficients: [f32; 5]) -> Intrinsics {
        let (fx, fy, ppx, ppy) = (600.0, 600.0, 319.5, 239.5);
        let (width, height) = (640, 480);
        Intrinsics::of(&RawIntrinsics { width, height, ppx, ppy, fx, fy, model, coefficients })
    }

    #[test]
    fn the_largest_distortion_is_found_at_a_corner_or_inside() {
        let mode = Settings::default().mode;
        assert_eq!(intrinsics(2, [0.0; 5]).largest_distortion(mode), Some(0.0));
        // A corner is 399.4 px, or 0.6656 focal lengths, from the principal point.
        let radial = intrinsics(4, [0.1, 0.0, 0.0, 0.0, 0.0]).largest_distortion(mode).unwrap();
        assert!((radial - 0.1 * 0.6656_f64.powi(3) * 600.0).abs() < 0.01, "{radial}");
        // At the corners it is 0, and in the middle of a side 0.4 of a focal length away it is not.
        let bent = [0.1, -0.1 / 0.6656_f32.powi(2), 0.0, 0.0, 0.0];
        let bent = intrinsics(4, bent).largest_distortion(mode).unwrap();
        assert!(bent > 2.0, "{bent}");
        assert_eq!(intrinsics(3, [0.1; 5]).largest_distortion(mode), None);
        assert_eq!(intrinsics(3, [0.0; 5]).largest_distortion(mode), Some(0.0));
    }

    #[test]
    fn the_modified_model_differs_where_a_tangential_part_meets_a_radial_one() {
        let mode = Settings::default().mode;
        let difference = |coefficients| intrinsics(1, coefficients).largest_modification(mode);
        assert_eq!(difference([-0.3, 0.1, 0.0, 0.0, 0.0]), 0.0);
        assert_eq!(difference([0.0, 0.0, 0.01, 0.01, 0.0]), 0.0);
        assert!(difference([-0.3, 0.0, 0.001, 0.0, 0.0]) > 0.02);
    }
}
