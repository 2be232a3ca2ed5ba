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

    /// Calls `f` with column and row in the full image and likeness of each pixel.
    pub(super) fn each(&self, mut f: impl FnMut(f64, f64, f32)) {
        for (y, row) in self.values.chunks_exact(self.width).enumerate() {
            for (x, &value) in row.iter().enumerate() {
                let (u, v) = self.to_full(x as f64, y as f64);
                f(u, v, value);
            }
        }
    }

    /// Returns the index of the value at column `u`, row `v` of the full image; `None` outside.
    #[inline]
    pub(super) fn index(&self, u: f64, v: f64) -> Option<usize> {
        let x = (u + 0.5 - self.origin.0) / Self::FACTOR;
        let y = (v + 0.5 - self.origin.1) / Self::FACTOR;
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| y as u32 as usize * self.width + x as u32 as usize)
    }

    /// Returns column and row in the full image of the centre of the pixel at column `x`, row `y`.
    #[inline]
    fn to_full(&self, x: f64, y: f64) -> (f64, f64) {
        let full = |k: f64, origin: f64| (k + 0.5) * Self::FACTOR - 0.5 + origin;
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
