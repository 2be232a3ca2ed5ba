//! Colours of the pixels behind a Bayer filter.

use plumb_frame::image::{Bgr, ImageSize};

/// Colours of the first two pixels of the first two rows, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BayerOrder {
    /// Red, green; green, blue.
    Rggb,
    /// Blue, green; green, red.
    Bggr,
    /// Green, blue; red, green.
    Gbrg,
    /// Green, red; blue, green.
    Grbg,
}

impl BayerOrder {
    /// Returns the column and the row of the first red pixel.
    fn red(self) -> [usize; 2] {
        match self {
            Self::Rggb => [0, 0],
            Self::Bggr => [1, 1],
            Self::Gbrg => [0, 1],
            Self::Grbg => [1, 0],
        }
    }
}

/// Samples at a pixel: its own, and the means of its neighbours.
struct Samples {
    own: u8,
    /// Left and right.
    row: u8,
    /// Above and below.
    column: u8,
    /// Left, right, above and below.
    edges: u8,
    corners: u8,
}

/// Returns the pixels (blue, green, red) of `bytes`, one for each pixel of `size`, row by row. A
/// colour that a pixel does not measure is the mean of the two or four neighbours that do
/// (bilinear). Beyond the border, the neighbour of the other side counts. `None` where the picture
/// has fewer than two columns or rows, or another number of bytes.
pub fn bgr_of_bayer(bytes: &[u8], size: ImageSize, order: BayerOrder) -> Option<Vec<Bgr>> {
    let ImageSize { width, height } = size;
    if width < 2 || height < 2 || Some(bytes.len()) != width.checked_mul(height) {
        return None;
    }
    let [red_column, red_row] = order.red();
    let row = |index: usize| &bytes[index * width..][..width];
    let mut pixels = Vec::with_capacity(bytes.len());
    for y in 0..height {
        let [above, below] = neighbours(y, height);
        let rows = [row(above), row(y), row(below)];
        let is_red_row = y % 2 == red_row;
        pixels.extend((0..width).map(|x| {
            let it = samples(rows, x, neighbours(x, width));
            match (x % 2 == red_column, is_red_row) {
                (true, true) => [it.corners, it.edges, it.own],
                (false, true) => [it.column, it.own, it.row],
                (true, false) => [it.row, it.own, it.column],
                (false, false) => [it.own, it.edges, it.corners],
            }
        }));
    }
    Some(pixels)
}

/// Returns the indices before and after `index` of `count`, which is at least 2. Beyond an end it
/// is the one inside, which has the same colour.
fn neighbours(index: usize, count: usize) -> [usize; 2] {
    let before = index.checked_sub(1).unwrap_or(1);
    let after = if index + 1 < count { index + 1 } else { index - 1 };
    [before, after]
}

/// Returns the samples at column `x` of the middle row, with the columns beside it.
fn samples([above, own, below]: [&[u8]; 3], x: usize, [left, right]: [usize; 2]) -> Samples {
    let sum = |a: u8, b: u8| u16::from(a) + u16::from(b);
    let (row, column) = (sum(own[left], own[right]), sum(above[x], below[x]));
    let corners = sum(above[left], above[right]) + sum(below[left], below[right]);
    Samples {
        own: own[x],
        row: row.div_ceil(2) as u8,
        column: column.div_ceil(2) as u8,
        edges: ((row + column + 2) / 4) as u8,
        corners: ((corners + 2) / 4) as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [(BayerOrder, &[u8; 4]); 4] = [
        (BayerOrder::Rggb, b"RGGB"),
        (BayerOrder::Bggr, b"BGGR"),
        (BayerOrder::Gbrg, b"GBRG"),
        (BayerOrder::Grbg, b"GRBG"),
    ];

    /// Returns what a sensor with these colours measures of a picture.
    fn mosaic(
        size: ImageSize,
        colours: &[u8; 4],
        picture: impl Fn(usize, usize) -> Bgr,
    ) -> Vec<u8> {
        let pixel = |k: usize| {
            let (x, y) = (k % size.width, k / size.width);
            let channel = match colours[2 * (y % 2) + x % 2] {
                b'B' => 0,
                b'G' => 1,
                _ => 2,
            };
            picture(x, y)[channel]
        };
        (0..size.width * size.height).map(pixel).collect()
    }

    #[test]
    fn a_plain_colour_comes_back_in_each_order() {
        for (order, colours) in ORDERS {
            for (width, height) in [(2, 2), (5, 4), (4, 3)] {
                let size = ImageSize { width, height };
                let bytes = mosaic(size, colours, |_, _| [10, 120, 230]);
                let pixels = bgr_of_bayer(&bytes, size, order).unwrap();
                assert_eq!(pixels, vec![[10, 120, 230]; width * height], "{order:?}");
            }
        }
    }

    #[test]
    fn a_ramp_comes_back_inside_each_order() {
        let (size, ramp) = (ImageSize { width: 8, height: 6 }, |x: usize, y: usize| {
            [(40 + 4 * x) as u8, (60 + 6 * y) as u8, (200 - 2 * x - 8 * y) as u8]
        });
        for (order, colours) in ORDERS {
            let pixels = bgr_of_bayer(&mosaic(size, colours, ramp), size, order).unwrap();
            for (x, y) in (1..7).flat_map(|x| (1..5).map(move |y| (x, y))) {
                assert_eq!(pixels[8 * y + x], ramp(x, y), "{order:?}: {x}, {y}");
            }
        }
    }

    #[test]
    fn a_picture_that_is_too_small_or_has_other_bytes_has_no_colours() {
        for (width, height, bytes) in [(1, 2, 2), (2, 1, 2), (2, 2, 3), (0, 0, 0)] {
            let size = ImageSize { width, height };
            assert_eq!(bgr_of_bayer(&vec![0; bytes], size, BayerOrder::Rggb), None);
        }
        let endless = ImageSize { width: usize::MAX, height: 2 };
        assert_eq!(bgr_of_bayer(&[], endless, BayerOrder::Rggb), None);
    }
}
