//! A window of the image at a half and at a quarter of the size.

use multiversion::multiversion;
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
    /// `vs` and columns `us` of the full image, in ascending order, row by row; outside of the
    /// level that of its border.
    pub(super) fn grid<const N: usize>(&self, us: [f64; N], vs: [f64; N]) -> Vec<[f32; 3]> {
        let columns = us.map(|u| Between::new(u, self.origin.0, self.factor, self.width));
        let rows = vs.map(|v| Between::new(v, self.origin.1, self.factor, self.height));
        let (start, end) = (columns[0].first, columns[N - 1].second + 1);
        let mut line = vec![[0.0; 3]; end - start];
        let mut colours = Vec::with_capacity(N * N);
        for row in rows {
            let part = |k: usize| self.pixels[k * self.width..][start..end].as_flattened();
            mix_lines(part(row.first), part(row.second), row.part, line.as_flattened_mut());
            colours.extend(columns.map(|Between { first, second, part }| {
                let (a, b) = (line[first - start], line[second - start]);
                [mixed(a[0], b[0], part), mixed(a[1], b[1], part), mixed(a[2], b[2], part)]
            }));
        }
        colours
    }
}

/// Writes the numbers at `part` of the way from those of line `a` to those of `b`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn mix_lines(a: &[u8], b: &[u8], part: f32, line: &mut [f32]) {
    for (place, (&a, &b)) in line.iter_mut().zip(a.iter().zip(b)) {
        *place = mixed(f32::from(a), f32::from(b), part);
    }
}

/// Returns the number at `part` of the way from `a` to `b`.
#[inline]
fn mixed(a: f32, b: f32, part: f32) -> f32 {
    a + part * (b - a)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_between_pixels_lie_on_a_straight_line_and_end_at_the_border() {
        // Blue grows by 16 with each column, red by 8 with each row: full-size pixels of 2 x 2.
        let pixels: Vec<Bgr> = (0..30).map(|i| [i as u8 % 6 * 16, 7, i as u8 / 6 * 8]).collect();
        let level =
            Level { width: 6, height: 5, pixels: &pixels, factor: 2.0, origin: (100.0, 40.0) };
        // The first pixel of the level is about (100.5, 40.5).
        let colours = level.grid([90.0, 101.0, 104.0, 200.0], [30.0, 41.5, 45.0, 99.0]);
        let (blue, red) = ([0.0, 4.0, 28.0, 80.0], [0.0, 4.0, 18.0, 32.0]);
        for (i, colour) in colours.into_iter().enumerate() {
            let expected = [blue[i % 4], 7.0, red[i / 4]];
            let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-4;
            assert!(colour.iter().zip(&expected).all(is_near), "{colour:?} {expected:?}");
        }
    }
}
