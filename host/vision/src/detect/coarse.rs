//! The ball's colour in a window of the picture, at a quarter of the size.

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Rect, Size, Vec3b};
use opencv::imgproc::{INTER_AREA, resize};

use super::colour::BallColour;
use crate::image::ColourImage;
use crate::mat::borrow_colour;

/// Pixels of the full picture in a pixel of the coarse one, either way.
const SHRINK: i32 = 4;

/// The ball's colour in a window of the picture, at a quarter of the size.
pub(super) struct Coarse {
    width: usize,
    height: usize,
    /// Column and row of the window's first pixel in the full picture.
    origin: (f64, f64),
    /// How much each pixel has of the ball's colour, 0 to 1, row by row.
    values: Vec<f32>,
}

impl Coarse {
    /// Pixels of the full picture in one of it, either way.
    pub(super) const SHRINK: f64 = SHRINK as f64;

    /// Of `window`, which is in the picture and not empty; up to three columns and rows at its end
    /// are left out.
    pub(super) fn new(
        colour: &ColourImage,
        window: Rect,
        ball: BallColour,
    ) -> opencv::Result<Self> {
        let colour = borrow_colour(colour)?;
        let coarse = |n: i32| (n / SHRINK).max(1);
        let whole = |n: i32| n.min(coarse(n) * SHRINK);
        let (width, height) = (coarse(window.width), coarse(window.height));
        let window = Rect::new(window.x, window.y, whole(window.width), whole(window.height));
        // OpenCV halves twice in a third of the time in which it quarters.
        let (mut half, mut small) = (Mat::default(), Mat::default());
        resize(
            &colour.roi(window)?,
            &mut half,
            Size::new(2 * width, 2 * height),
            0.0,
            0.0,
            INTER_AREA,
        )?;
        resize(&half, &mut small, Size::new(width, height), 0.0, 0.0, INTER_AREA)?;
        let values = small
            .data_typed::<Vec3b>()?
            .iter()
            .map(|pixel| ball.of(pixel.0.map(f32::from)))
            .collect();
        let origin = (f64::from(window.x), f64::from(window.y));
        Ok(Self { width: width as usize, height: height as usize, origin, values })
    }

    /// Columns.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// How much each pixel has of the ball's colour, 0 to 1, row by row.
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Each pixel's column and row in the full picture, and its value.
    pub(super) fn each(&self, mut f: impl FnMut(f64, f64, f32)) {
        for (y, row) in self.values.chunks_exact(self.width).enumerate() {
            for (x, &value) in row.iter().enumerate() {
                let (u, v) = self.full(x as f64, y as f64);
                f(u, v, value);
            }
        }
    }

    /// The pixel in which the full picture has column `u`, row `v`: its place among the values;
    /// `None` outside.
    pub(super) fn index(&self, u: f64, v: f64) -> Option<usize> {
        let (x, y) =
            ((u + 0.5 - self.origin.0) / Self::SHRINK, (v + 0.5 - self.origin.1) / Self::SHRINK);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| y as u32 as usize * self.width + x as u32 as usize)
    }

    /// Where the middle of the pixel in column `x`, row `y` is in the full picture.
    pub(super) fn full(&self, x: f64, y: f64) -> (f64, f64) {
        let full = |k: f64, origin: f64| (k + 0.5) * Self::SHRINK - 0.5 + origin;
        (full(x, self.origin.0), full(y, self.origin.1))
    }
}
