//! One picture with depth, as every source gives it.

use opencv::core::{CV_8UC3, CV_16UC1, Mat, MatTraitConst, Size};
use thiserror::Error;

use crate::camera::Intrinsics;

/// A colour picture and the depth registered to it, taken at one moment.
#[derive(Debug, Clone)]
pub struct RgbdFrame {
    time: f64,
    colour: Mat,
    depth: Mat,
    intrinsics: Intrinsics,
}

/// Why two pictures do not make a frame.
#[derive(Debug, Error, PartialEq)]
pub enum FrameError {
    /// The colour picture is empty or of another type than 8-bit BGR.
    #[error("the colour picture must be 8-bit BGR and not empty (its OpenCV type is {0})")]
    Colour(i32),
    /// The depth picture is of another type than 16-bit.
    #[error("the depth picture must be 16-bit with one channel (its OpenCV type is {0})")]
    Depth(i32),
    /// Registered pictures have one size.
    #[error("the colour picture is {}x{} but the depth picture is {}x{}: depth must be registered to colour", .colour.width, .colour.height, .depth.width, .depth.height)]
    Size {
        /// Size of the colour picture, pixels.
        colour: Size,
        /// Size of the depth picture, pixels.
        depth: Size,
    },
    /// The time stamp is not a number.
    #[error("the time stamp {0} is not a finite number")]
    Time(f64),
}

impl RgbdFrame {
    /// A frame taken at `time` (seconds on the source's clock) from an 8-bit BGR picture and a
    /// 16-bit depth picture of the same size, in `intrinsics.depth_scale` units a metre, 0 = no
    /// depth.
    ///
    /// # Errors
    /// Where a type, a size or the time stamp is not as said.
    pub fn new(
        time: f64,
        colour: Mat,
        depth: Mat,
        intrinsics: Intrinsics,
    ) -> Result<Self, FrameError> {
        if colour.typ() != CV_8UC3 || colour.empty() {
            return Err(FrameError::Colour(colour.typ()));
        }
        if depth.typ() != CV_16UC1 {
            return Err(FrameError::Depth(depth.typ()));
        }
        let (c, d) = (colour.size().unwrap_or_default(), depth.size().unwrap_or_default());
        if c != d {
            return Err(FrameError::Size { colour: c, depth: d });
        }
        if !time.is_finite() {
            return Err(FrameError::Time(time));
        }
        Ok(Self { time, colour, depth, intrinsics })
    }

    /// When the picture was taken, seconds on the source's clock.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The same pictures, taken at `time`, seconds on another clock.
    ///
    /// # Errors
    /// Where the time stamp is not a finite number.
    pub fn with_time(self, time: f64) -> Result<Self, FrameError> {
        if time.is_finite() { Ok(Self { time, ..self }) } else { Err(FrameError::Time(time)) }
    }

    /// The colour picture, 8-bit BGR.
    pub fn colour(&self) -> &Mat {
        &self.colour
    }

    /// The registered depth picture, 16-bit, 0 = no depth.
    pub fn depth(&self) -> &Mat {
        &self.depth
    }

    /// How pixels and depth become points.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Depth in metres at column `u`, row `v`; `None` outside the picture or where there is none.
    pub fn depth_at(&self, u: i32, v: i32) -> Option<f64> {
        if u < 0 || v < 0 || u >= self.depth.cols() || v >= self.depth.rows() {
            return None;
        }
        let raw = *self.depth.at_2d::<u16>(v, u).ok()?;
        (raw != 0).then(|| f64::from(raw) / self.intrinsics.depth_scale)
    }
}
