//! A window of the image at a half, at a quarter, and at smaller parts of the size.

use std::array;

use multiversion::multiversion;

use crate::image::{Bgr, ColourImage};

/// Number of pixels of the full image, in a row, in a pixel of the level at a quarter of the size.
pub(super) const QUARTER: usize = 4;
/// Index of that level.
pub(super) const QUARTER_LEVEL: usize = 2;

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
    /// Pixels of the level for one pixel of the full image, in a row: 1, 1/2, 1/4 or less.
    pub(super) scale: f64,
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
    /// Returns the place of `k`, a column or row of the full image, in a level of this scale and of
    /// `size` columns or rows that starts at `origin`; the border if it is outside.
    fn new(k: f64, origin: f64, scale: f64, size: usize) -> Self {
        let place = ((k + 0.5 - origin) * scale - 0.5).clamp(0.0, (size - 1) as f64);
        let first = place as usize;
        let part = (place - first as f64) as f32;
        Self { first, second: (first + 1).min(size - 1), part }
    }
}

impl Level<'_> {
    /// Returns the colours (blue, green, red, 0 to 255) between the pixels about each of the
    /// `rows`, row by row: the row and its columns in ascending order, of the full image. Outside
    /// of the level they are those of its border.
    pub(super) fn grid<const N: usize>(&self, rows: [(f64, [f64; N]); N]) -> Vec<[f32; 3]> {
        let mut line = Vec::new();
        let mut colours = Vec::with_capacity(N * N);
        for (v, us) in rows {
            let row = Between::new(v, self.origin.1, self.scale, self.height);
            let columns = us.map(|u| Between::new(u, self.origin.0, self.scale, self.width));
            let (start, end) = (columns[0].first, columns[N - 1].second + 1);
            let part = |k: usize| self.pixels[k * self.width..][start..end].as_flattened();
            line.resize(end - start, [0.0; 3]);
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
pub(super) fn mixed(a: f32, b: f32, part: f32) -> f32 {
    a + part * (b - a)
}

/// A window of the image at a half, at a quarter, and at smaller parts of the size.
#[derive(Debug)]
pub(super) struct Pyramid {
    window: Window,
    /// The parts, each half as large as the one before.
    parts: Vec<Part>,
}

/// A window of the image at a part of the size.
#[derive(Debug)]
struct Part {
    columns: usize,
    rows: usize,
    pixels: Vec<Bgr>,
}

impl Pyramid {
    /// Downsamples `window`, which lies in `image`, to a quarter of the size, and `coarser` times
    /// more as long as there are pixels; up to three columns and rows at its end are left out, and
    /// then the last one if their number is odd. Returns `None` if the window is smaller than a
    /// pixel at a quarter of the size.
    pub(super) fn new(image: &ColourImage, window: Window, coarser: usize) -> Option<Self> {
        let (mut columns, mut rows) = (window.width / QUARTER, window.height / QUARTER);
        if columns == 0 || rows == 0 {
            return None;
        }
        let pixels = &image.pixels()[window.top * image.width() + window.left..];
        let half = halved(pixels, image.width(), [2 * columns, 2 * rows]);
        let quarter = halved(&half, 2 * columns, [columns, rows]);
        let half = Part { columns: 2 * columns, rows: 2 * rows, pixels: half };
        let mut parts = vec![half, Part { columns, rows, pixels: quarter }];
        for _ in 0..coarser {
            let width = columns;
            (columns, rows) = (columns / 2, rows / 2);
            let Some(finer) = parts.last().filter(|_| columns > 0 && rows > 0) else { break };
            let pixels = halved(&finer.pixels, width, [columns, rows]);
            parts.push(Part { columns, rows, pixels });
        }
        Some(Self { window, parts })
    }

    /// Returns `image` itself and the window at half the size, at a quarter, and so on.
    pub(super) fn levels<'a>(&'a self, image: &'a ColourImage) -> Vec<Level<'a>> {
        let (width, height, pixels) = (image.width(), image.height(), image.pixels());
        let full = Level { width, height, pixels, scale: 1.0, origin: (0.0, 0.0) };
        let origin = (self.window.left as f64, self.window.top as f64);
        let scales = std::iter::successors(Some(0.5), |scale| Some(scale / 2.0));
        let parts = self.parts.iter().zip(scales).map(|(part, scale)| {
            let Part { columns: width, rows: height, ref pixels } = *part;
            Level { width, height, pixels, scale, origin }
        });
        std::iter::once(full).chain(parts).collect()
    }
}

/// Returns a part of an image at half the size, `columns` times `rows`: each pixel is the mean of
/// four. `pixels` are those from the part's first pixel on; `width` of them are a row of the image.
///
/// OpenCV's `resize` gives the same and takes about twice as long.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512vbmi", "x86_64+avx2"))]
fn halved(pixels: &[Bgr], width: usize, [columns, rows]: [usize; 2]) -> Vec<Bgr> {
    let mut halved = vec![[0; 3]; columns * rows];
    let [mut upper, mut lower, mut means] = [2 * columns, 2 * columns, columns].map(Planes::new);
    let lines = (0..rows).map(|row| &pixels[2 * row * width..]);
    for (pixels, line) in lines.zip(halved.chunks_exact_mut(columns)) {
        upper.split(&pixels[..2 * columns]);
        lower.split(&pixels[width..][..2 * columns]);
        means.halve(&upper, &lower);
        means.join(line);
    }
    halved
}

/// The blue, green and red of a row of pixels, each in a row of its own: on such rows the compiler
/// computes many bytes at a time.
struct Planes([Vec<u8>; 3]);

impl Planes {
    /// Makes black pixels.
    fn new(columns: usize) -> Self {
        Self(array::from_fn(|_| vec![0; columns]))
    }

    /// Takes the colours of a row.
    #[inline(always)]
    fn split(&mut self, row: &[Bgr]) {
        let [blue, green, red] = &mut self.0;
        let places = blue.iter_mut().zip(green).zip(red);
        for (pixel, ((blue, green), red)) in row.iter().zip(places) {
            [*blue, *green, *red] = *pixel;
        }
    }

    /// Takes the means of two pixels of a row and the two below.
    #[inline(always)]
    fn halve(&mut self, upper: &Self, lower: &Self) {
        for (means, (upper, lower)) in self.0.iter_mut().zip(upper.0.iter().zip(&lower.0)) {
            let squares = upper.as_chunks().0.iter().zip(lower.as_chunks().0);
            for (mean, (&[a, b], &[c, d])) in means.iter_mut().zip(squares) {
                let four = [a, b, c, d].map(u16::from);
                *mean = ((four.iter().sum::<u16>() + 2) / 4) as u8;
            }
        }
    }

    /// Writes the pixels to a row.
    #[inline(always)]
    fn join(&self, row: &mut [Bgr]) {
        let [blue, green, red] = &self.0;
        let colours = blue.iter().zip(green).zip(red);
        for (pixel, ((&blue, &green), &red)) in row.iter_mut().zip(colours) {
            *pixel = [blue, green, red];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the colour (in 16 bits) of a level's pixel at column `x`, row `y`.
    fn at(level: &Level, (x, y): (usize, usize)) -> [u16; 3] {
        level.pixels[y * level.width + x].map(u16::from)
    }

    #[test]
    fn a_pixel_of_a_level_is_the_mean_of_four_of_the_level_below() {
        // Less and more than the pixels that are computed at a time.
        for columns in [1, 3, 9, 70] {
            let (width, height) = (4 * columns + 9, 14);
            let pixels = (0..width * height).map(|i| [i, i * i * 31, 7 * i].map(|k| k as u8));
            let image = ColourImage::new(width, height, pixels.collect()).unwrap();
            let window = Window { left: 5, top: 1, width: 4 * columns + 3, height: 12 };
            // Three rows of a quarter of the size are one row at an eighth, and none after it.
            let pyramid = Pyramid::new(&image, window, 2).unwrap();
            let levels = pyramid.levels(&image);
            assert_eq!([levels[2].width, levels[2].height], [columns, 3]);
            assert_eq!(levels.len(), if columns == 1 { 3 } else { 4 });
            for (k, pair) in levels.windows(2).enumerate() {
                let (below, above) = (&pair[0], &pair[1]);
                assert_eq!(above.scale, below.scale / 2.0);
                let (left, top) = if k == 0 { (5, 1) } else { (0, 0) };
                let size = above.width * above.height;
                for (x, y) in (0..size).map(|i| (i % above.width, i / above.width)) {
                    let four = [(0, 0), (1, 0), (0, 1), (1, 1)]
                        .map(|(dx, dy)| at(below, (left + 2 * x + dx, top + 2 * y + dy)));
                    let mean = |k: usize| (four.iter().map(|pixel| pixel[k]).sum::<u16>() + 2) / 4;
                    assert_eq!(at(above, (x, y)), array::from_fn(mean), "{columns}, {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn a_window_smaller_than_a_pixel_has_no_levels() {
        let image = ColourImage::new(8, 8, vec![[0; 3]; 64]).unwrap();
        for (width, height) in [(3, 8), (8, 3), (1, 1)] {
            let window = Window { left: 0, top: 0, width, height };
            assert!(Pyramid::new(&image, window, 0).is_none());
        }
    }

    #[test]
    fn colours_between_pixels_lie_on_a_straight_line_and_end_at_the_border() {
        // Blue grows by 16 with each column, red by 8 with each row: full-size pixels of 2 x 2.
        let pixels: Vec<Bgr> = (0..30).map(|i| [i as u8 % 6 * 16, 7, i as u8 / 6 * 8]).collect();
        let level =
            Level { width: 6, height: 5, pixels: &pixels, scale: 0.5, origin: (100.0, 40.0) };
        // The first pixel of the level is about (100.5, 40.5).
        let columns = [90.0, 101.0, 104.0, 200.0];
        let colours = level.grid([30.0, 41.5, 45.0, 99.0].map(|row| (row, columns)));
        let (blue, red) = ([0.0, 4.0, 28.0, 80.0], [0.0, 4.0, 18.0, 32.0]);
        for (i, colour) in colours.into_iter().enumerate() {
            let expected = [blue[i % 4], 7.0, red[i / 4]];
            let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-4;
            assert!(colour.iter().zip(&expected).all(is_near), "{colour:?} {expected:?}");
        }
    }
}
