//! Likeness to the ball's colour in a window of the image, at a quarter of the size.

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Rect, Size, Vec3b};
use opencv::imgproc::{INTER_AREA, resize};

use super::ball_colour::BallColour;
use crate::image::ColourImage;
use crate::mat::borrow_colour;

/// Pixels of the full image in a downsampled pixel, in either direction.
const FACTOR: i32 = 4;

/// A window of the image, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// Columns, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
}

/// Likeness to the ball's colour in a window of the image, at a quarter of the size.
#[derive(Debug, Clone, PartialEq)]
pub struct LikenessMap {
    width: usize,
    height: usize,
    /// Column and row of the window's first pixel in the full image.
    origin: (f64, f64),
    values: Vec<f32>,
}

impl LikenessMap {
    /// Pixels of the full image in a downsampled pixel, in either direction.
    pub const FACTOR: f64 = FACTOR as f64;

    /// Downsamples `window`, which lies in the image; up to three columns and rows at its end are
    /// left out.
    pub(super) fn new(
        colour: &ColourImage,
        window: Window,
        ball: BallColour,
    ) -> opencv::Result<Self> {
        let small = |n: usize| (n as i32 / FACTOR).max(1);
        let whole = |n: usize| (n as i32).min(small(n) * FACTOR);
        let (width, height) = (small(window.width), small(window.height));
        let (left, top) = (window.left as i32, window.top as i32);
        let area = Rect::new(left, top, whole(window.width), whole(window.height));
        // OpenCV halves twice in a third of the time in which it quarters.
        let (mut half, mut quarter) = (Mat::default(), Mat::default());
        let image = borrow_colour(colour)?;
        let size = Size::new(2 * width, 2 * height);
        resize(&image.roi(area)?, &mut half, size, 0.0, 0.0, INTER_AREA)?;
        resize(&half, &mut quarter, Size::new(width, height), 0.0, 0.0, INTER_AREA)?;
        let pixels = quarter.data_typed::<Vec3b>()?.iter();
        let values = pixels.map(|pixel| ball.likeness(pixel.0.map(f32::from))).collect();
        let origin = (f64::from(left), f64::from(top));
        Ok(Self { width: width as usize, height: height as usize, origin, values })
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the likenesses, 0 to 1, row by row.
    #[inline]
    pub fn values(&self) -> &[f32] {
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

    /// Returns the likeness at column `u`, row `v` of the full image; `None` outside the window.
    pub fn at(&self, u: f64, v: f64) -> Option<f32> {
        self.index(u, v).map(|i| self.values[i])
    }

    /// Returns column and row in the full image of the centre of the pixel at column `x`, row `y`.
    #[inline]
    pub fn to_full(&self, x: f64, y: f64) -> (f64, f64) {
        let full = |k: f64, origin: f64| (k + 0.5) * Self::FACTOR - 0.5 + origin;
        (full(x, self.origin.0), full(y, self.origin.1))
    }
}
