//! Likeness to the ball's colour in a window of the image, at a quarter of the size.

use multiversion::multiversion;

use super::ball_colour::BallColour;
use super::pyramid::{Level, SMALLEST};
use crate::image::Bgr;

/// Likeness to the ball's colour in a window of the image, at a quarter of the size.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LikenessMap {
    width: usize,
    height: usize,
    /// Column and row of the window's first pixel in the full image.
    origin: (f64, f64),
    values: Vec<f32>,
}

impl LikenessMap {
    /// Pixels of the full image in a downsampled pixel, in either direction.
    pub(super) const FACTOR: f64 = SMALLEST as f64;

    /// Reads the likeness of the pixels of `level`, a window at a quarter of the size.
    pub(super) fn new(level: &Level, ball: BallColour) -> Self {
        let mut values = vec![0.0; level.pixels.len()];
        read_likeness(level.pixels, ball, &mut values);
        Self { width: level.width, height: level.height, origin: level.origin, values }
    }

    /// Returns the likenesses, 0 to 1, row by row.
    #[inline]
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the number of columns.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Returns the index of the value at column `x`, row `y` of the map; `None` outside.
    #[inline]
    pub(super) fn index(&self, x: i32, y: i32) -> Option<usize> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then_some(y * self.width + x)
    }

    /// Returns column and row of the full image's first pixel in the pixel at column `x`, row `y`.
    #[inline]
    pub(super) fn first(&self, x: usize, y: usize) -> (usize, usize) {
        (self.origin.0 as usize + SMALLEST * x, self.origin.1 as usize + SMALLEST * y)
    }

    /// Returns column and row in the full image of the centre of the pixel at column `x`, row `y`.
    #[inline]
    pub(super) fn to_full(&self, x: usize, y: usize) -> (f64, f64) {
        let full = |k: usize, origin: f64| (k as f64 + 0.5) * Self::FACTOR - 0.5 + origin;
        (full(x, self.origin.0), full(y, self.origin.1))
    }
}

/// Writes the likeness of each pixel to the ball's colour.
#[multiversion(targets("x86_64+avx2"))]
fn read_likeness(pixels: &[Bgr], ball: BallColour, values: &mut [f32]) {
    for (value, pixel) in values.iter_mut().zip(pixels) {
        *value = ball.likeness(pixel.map(f32::from));
    }
}
