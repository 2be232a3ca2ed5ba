//! The picture that is searched, to be read at any place.

use super::colour::BallColour;
use super::rays::{self, RAYS};
use crate::camera::Intrinsics;
use crate::image::{Bgr, ColourImage};

/// A ball's picture. The radius is that of a ball as far away on the optical axis, f R / z nearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Disc {
    pub(super) u: f64,
    pub(super) v: f64,
    pub(super) radius: f64,
}

/// The picture that is searched.
pub(super) struct Picture<'a> {
    pixels: &'a [Bgr],
    width: usize,
    height: usize,
    intrinsics: &'a Intrinsics,
    ball: BallColour,
    directions: [(f64, f64); RAYS],
}

impl<'a> Picture<'a> {
    /// In which `ball` is looked for.
    pub(super) fn new(
        colour: &'a ColourImage,
        intrinsics: &'a Intrinsics,
        ball: BallColour,
    ) -> Self {
        let (width, height) = (colour.width(), colour.height());
        let directions = rays::directions();
        Self { pixels: colour.pixels(), width, height, intrinsics, ball, directions }
    }

    /// How its pixels are rays.
    pub(super) fn intrinsics(&self) -> &Intrinsics {
        self.intrinsics
    }

    /// The colour that is looked for.
    pub(super) fn ball(&self) -> BallColour {
        self.ball
    }

    /// Cosine and sine of the angle of each ray of a disc.
    pub(super) fn directions(&self) -> &[(f64, f64); RAYS] {
        &self.directions
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// All of its pixels, row by row.
    pub(super) fn pixels(&self) -> &[Bgr] {
        self.pixels
    }

    /// The colour (blue, green, red, 0 to 255) of the pixel nearest to (`u`, `v`); `None` outside
    /// the picture.
    #[inline]
    pub(super) fn colour_at(&self, u: f64, v: f64) -> Option<[f32; 3]> {
        let (x, y) = (u + 0.5, v + 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside
            .then(|| self.pixels[y as u32 as usize * self.width + x as u32 as usize].map(f32::from))
    }

    /// How much of the ball's colour the pixel nearest to (`u`, `v`) has, 0 to 1; 0 outside the
    /// picture.
    #[inline]
    pub(super) fn likeness(&self, u: f64, v: f64) -> f32 {
        self.colour_at(u, v).map_or(0.0, |colour| self.ball.of(colour))
    }
}
