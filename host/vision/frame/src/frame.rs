//! A colour image with registered depth.

use thiserror::Error;

use crate::camera::Intrinsics;
use crate::image::{ColourImage, DepthImage, ImageSize};

/// A colour image and the depth registered to it, taken at one moment.
#[derive(Debug, Clone)]
pub struct RgbdFrame {
    time: f64,
    colour: ColourImage,
    depth: DepthImage,
    intrinsics: Intrinsics,
    sender_stamp: Option<SenderStamp>,
    ground_truth: Option<GroundTruth>,
}

/// Time stamp of a colour image as the program states it that has sent it, bit for bit: other
/// programs join their data to the image by it. Its clock may be any.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SenderStamp {
    /// Whole seconds.
    pub seconds: i32,
    /// Nanoseconds after them.
    pub nanoseconds: u32,
}

/// What a simulation knows of a frame that no camera shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundTruth {
    /// Tension of each cable over the ball's weight, >= 0; order A, B, C.
    pub tensions: [f64; 3],
}

/// Reasons why two images do not make a frame.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FrameError {
    /// The colour image has no pixels.
    #[error("the colour picture is empty")]
    Empty,
    /// The images differ in size, so depth is not registered to colour.
    #[error(
        "the colour picture is {colour} but the depth picture is {depth}: depth must be \
         registered to colour"
    )]
    Size {
        /// Size of the colour image.
        colour: ImageSize,
        /// Size of the depth image.
        depth: ImageSize,
    },
    /// The time stamp is not a finite number.
    #[error("the time stamp {0} is not a finite number")]
    Time(f64),
}

impl RgbdFrame {
    /// Makes a frame from a colour image and a depth image of the same size.
    ///
    /// `time` is in seconds on the source's clock. The depth image has `intrinsics.depth_scale`
    /// units to the metre; 0 means that the depth is unknown. With a `depth_scale` of 0 the camera
    /// has no depth, and all of the depth image is made unknown.
    ///
    /// # Errors
    /// Returns an error if the colour image is empty, the sizes differ, or the time stamp is not
    /// finite.
    pub fn new(
        time: f64,
        colour: ColourImage,
        mut depth: DepthImage,
        intrinsics: Intrinsics,
    ) -> Result<Self, FrameError> {
        if colour.pixels().is_empty() {
            return Err(FrameError::Empty);
        }
        if colour.size() != depth.size() {
            return Err(FrameError::Size { colour: colour.size(), depth: depth.size() });
        }
        if !time.is_finite() {
            return Err(FrameError::Time(time));
        }
        if !intrinsics.has_depth() {
            depth.pixels_mut().fill(0);
        }
        Ok(Self { time, colour, depth, intrinsics, sender_stamp: None, ground_truth: None })
    }

    /// Returns when the frame was taken, seconds on the source's clock.
    #[inline]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns the same frame with the time stamp `time`, seconds on another clock.
    ///
    /// # Errors
    /// Returns an error if `time` is not finite.
    pub fn with_time(self, time: f64) -> Result<Self, FrameError> {
        if time.is_finite() { Ok(Self { time, ..self }) } else { Err(FrameError::Time(time)) }
    }

    /// Returns the same frame with the stamp that its sender states.
    #[must_use]
    pub fn with_sender_stamp(self, sender_stamp: Option<SenderStamp>) -> Self {
        Self { sender_stamp, ..self }
    }

    /// Returns the stamp of the colour image as its sender states it; `None` for a frame that no
    /// other program has stamped.
    #[inline]
    pub fn sender_stamp(&self) -> Option<SenderStamp> {
        self.sender_stamp
    }

    /// Returns the same frame with this ground truth.
    #[must_use]
    pub fn with_ground_truth(self, ground_truth: Option<GroundTruth>) -> Self {
        Self { ground_truth, ..self }
    }

    /// Returns what the simulation knows of the frame; `None` for a frame of a camera or a
    /// recording.
    #[inline]
    pub fn ground_truth(&self) -> Option<GroundTruth> {
        self.ground_truth
    }

    /// Returns the colour image, 8-bit BGR.
    #[inline]
    pub fn colour(&self) -> &ColourImage {
        &self.colour
    }

    /// Returns the registered depth image; 0 means that the depth is unknown.
    #[inline]
    pub fn depth(&self) -> &DepthImage {
        &self.depth
    }

    /// Returns the intrinsics of both images.
    #[inline]
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Returns the depth in metres at column `u`, row `v`; `None` outside the image or where the
    /// depth is unknown.
    #[inline]
    pub fn depth_at(&self, u: i32, v: i32) -> Option<f64> {
        let raw = self.depth.get(usize::try_from(u).ok()?, usize::try_from(v).ok()?)?;
        (raw != 0).then(|| f64::from(raw) / self.intrinsics.depth_scale)
    }
}
