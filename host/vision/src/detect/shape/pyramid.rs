//! A window of the image at a half and at a quarter of the size.

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Rect, Size};
use opencv::imgproc::{INTER_AREA, resize};

use crate::image::{Bgr, ColourImage};
use crate::mat::borrow_colour;

/// Number of pixels of the full image, in a row, in a pixel of the smallest level.
pub(super) const SMALLEST: usize = 4;

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

/// Pixels of an image or of a part of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: &'a [Bgr],
    /// Number of pixels of the full image, in a row, in one of the level.
    pub(super) factor: f64,
    /// Column and row of the first pixel in the full image.
    pub(super) origin: (f64, f64),
}

/// A place between two columns or rows of a level.
#[derive(Debug, Clone, Copy)]
struct Between {
    first: usize,
    second: usize,
    /// Part of the way to the second.
    part: f32,
}

impl Between {
    /// Returns the place of `k`, a column or row of the full image, in a level of `size` columns or
    /// rows that starts at `origin`; the border if it is outside.
    fn new(k: f64, origin: f64, factor: f64, size: usize) -> Self {
        let place = ((k + 0.5 - origin) / factor - 0.5).clamp(0.0, (size - 1) as f64);
        let first = place as usize;
        let part = (place - first as f64) as f32;
        Self { first, second: (first + 1).min(size - 1), part }
    }
}

impl Level<'_> {
    /// Returns the colours (blue, green, red, 0 to 255) between the pixels about each of the rows
    /// `vs` and columns `us` of the full image, row by row; outside of the level that of its
    /// border.
    pub(super) fn grid<const N: usize>(&self, us: [f64; N], vs: [f64; N]) -> Vec<[f32; 3]> {
        let columns = us.map(|u| Between::new(u, self.origin.0, self.factor, self.width));
        let rows = vs.map(|v| Between::new(v, self.origin.1, self.factor, self.height));
        let mut colours = Vec::with_capacity(N * N);
        for row in rows {
            let line = |k: usize| &self.pixels[k * self.width..][..self.width];
            let (upper, lower) = (line(row.first), line(row.second));
            colours.extend(columns.map(|Between { first, second, part }| {
                let across = |line: &[Bgr]| {
                    mixed(line[first].map(f32::from), line[second].map(f32::from), part)
                };
                mixed(across(upper), across(lower), row.part)
            }));
        }
        colours
    }
}

/// Returns the colour at `part` of the way from `a` to `b`.
#[inline]
fn mixed(a: [f32; 3], b: [f32; 3], part: f32) -> [f32; 3] {
    [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2])]
}

/// A window of the image at a half and at a quarter of the size.
#[derive(Debug)]
pub(super) struct Pyramid {
    window: Window,
    half: Mat,
    quarter: Mat,
}

impl Pyramid {
    /// Downsamples `window`, which lies in `image`; up to three columns and rows at its end are
    /// left out.
    pub(super) fn new(image: &ColourImage, window: Window) -> opencv::Result<Self> {
        let small = |n: usize| (n / SMALLEST).max(1) as i32;
        let whole = |n: usize| (n as i32).min(small(n) * SMALLEST as i32);
        let (left, top) = (window.left as i32, window.top as i32);
        let area = Rect::new(left, top, whole(window.width), whole(window.height));
        let size = Size::new(small(window.width), small(window.height));
        // OpenCV halves twice in a third of the time in which it quarters.
        let (mut half, mut quarter) = (Mat::default(), Mat::default());
        let image = borrow_colour(image)?;
        let twice = Size::new(2 * size.width, 2 * size.height);
        resize(&image.roi(area)?, &mut half, twice, 0.0, 0.0, INTER_AREA)?;
        resize(&half, &mut quarter, size, 0.0, 0.0, INTER_AREA)?;
        Ok(Self { window, half, quarter })
    }

    /// Returns `image` itself and the window at a half and at a quarter of the size.
    pub(super) fn levels<'a>(&'a self, image: &'a ColourImage) -> opencv::Result<[Level<'a>; 3]> {
        let (width, height, pixels) = (image.width(), image.height(), image.pixels());
        let full = Level { width, height, pixels, factor: 1.0, origin: (0.0, 0.0) };
        Ok([full, self.level(&self.half, 2)?, self.level(&self.quarter, SMALLEST)?])
    }

    fn level<'a>(&self, mat: &'a Mat, factor: usize) -> opencv::Result<Level<'a>> {
        let (width, height) = (mat.cols() as usize, mat.rows() as usize);
        let origin = (self.window.left as f64, self.window.top as f64);
        let pixels = mat.data_bytes()?.as_chunks().0;
        Ok(Level { width, height, pixels, factor: factor as f64, origin })
    }
}
