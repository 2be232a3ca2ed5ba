//! Table `[intrinsics]` of a camera file.

use std::fmt;

use plumb_frame::camera::{
    CalibratedFor, Distortion, DistortionCoefficients, DistortionError, Intrinsics,
};
use plumb_frame::image::ImageSize;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use thiserror::Error;

use plumb_config::quantity::{
    DepthUnits, DistortionCoefficient, FocalLength, PixelCoordinate, some_pixels,
};

/// Value of `intrinsics.depth_scale` of a camera without depth.
pub(crate) const NO_DEPTH: &str = "none";

/// Table `[intrinsics]` with a distortion that can be inverted.
#[derive(Debug, Deserialize)]
#[serde(try_from = "IntrinsicsTable")]
pub(super) struct CheckedIntrinsics {
    pub(super) intrinsics: Intrinsics,
    pub(super) calibrated_for: CalibratedFor,
}

/// Mistake in the table `[intrinsics]`.
#[derive(Debug, Error)]
pub(super) enum IntrinsicsError {
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
