//! Images in memory: a width, a height and contiguous pixels.

use std::fmt;

use thiserror::Error;

/// A pixel of a colour image: blue, green, red, 0 to 255 each (OpenCV's order).
pub type Bgr = [u8; 3];
/// A colour image, 8-bit BGR.
pub type ColourImage = Image<Bgr>;
/// A depth image, 16-bit; 0 means that the depth is unknown.
pub type DepthImage = Image<u16>;

/// Columns and rows of an image, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageSize {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Error of an image whose number of pixels does not match its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("an image of {size} pixels cannot be made from {pixels} pixels")]
pub struct ImageError {
    /// Size that was asked for.
    pub size: ImageSize,
    /// Number of pixels that were given.
    pub pixels: usize,
}

/// An image with pixels of type `P`, row by row from the top left, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<P> {
    size: ImageSize,
    pixels: Vec<P>,
}

impl<P: Copy> Image<P> {
    /// Makes an image of `width` columns from its pixels, row by row.
    ///
    /// # Errors
    /// Returns an error if there are not exactly `width * height` pixels.
    pub fn new(width: usize, height: usize, pixels: Vec<P>) -> Result<Self, ImageError> {
        let size = ImageSize { width, height };
        if width.checked_mul(height) == Some(pixels.len()) {
            Ok(Self { size, pixels })
        } else {
            Err(ImageError { size, pixels: pixels.len() })
        }
    }

    /// Makes an image with the same pixel everywhere.
    pub fn filled(width: usize, height: usize, pixel: P) -> Self {
        Self { size: ImageSize { width, height }, pixels: vec![pixel; width * height] }
    }

    /// Makes an image from a function of column and row.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> P) -> Self {
        let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        let pixels = places.map(|(column, row)| f(column, row)).collect();
        Self { size: ImageSize { width, height }, pixels }
    }

    /// Returns the number of columns.
    #[inline]
    pub fn width(&self) -> usize {
        self.size.width
    }

    /// Returns the number of rows.
    #[inline]
    pub fn height(&self) -> usize {
        self.size.height
    }

    /// Returns columns and rows.
    #[inline]
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Returns all pixels, row by row.
    #[inline]
    pub fn pixels(&self) -> &[P] {
        &self.pixels
    }

    /// Returns all pixels, row by row, to be changed.
    #[inline]
    pub fn pixels_mut(&mut self) -> &mut [P] {
        &mut self.pixels
    }

    /// Returns the rows from the top.
    #[inline]
    pub fn rows(&self) -> std::slice::ChunksExact<'_, P> {
        // An image without columns has no pixels, whatever the length of a chunk.
        self.pixels.chunks_exact(self.size.width.max(1))
    }

    /// Returns the pixel at `column`, `row`; `None` outside the image.
    #[inline]
    pub fn get(&self, column: usize, row: usize) -> Option<P> {
        let inside = column < self.size.width && row < self.size.height;
        inside.then(|| self.pixels[row * self.size.width + column])
    }
}

impl<const N: usize> Image<[u8; N]> {
    /// Returns the channels of all pixels, row by row: N bytes for each pixel.
    #[inline]
    pub fn channels(&self) -> &[u8] {
        self.pixels.as_flattened()
    }

    /// Returns the channels of all pixels, to be changed.
    #[inline]
    pub fn channels_mut(&mut self) -> &mut [u8] {
        self.pixels.as_flattened_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_row_by_row() {
        let image = Image::from_fn(3, 2, |column, row| (10 * row + column) as u16);
        assert_eq!(image.pixels(), [0, 1, 2, 10, 11, 12]);
        assert_eq!((image.get(2, 1), image.get(3, 0), image.get(0, 2)), (Some(12), None, None));
        assert_eq!(image.rows().collect::<Vec<_>>(), [&[0, 1, 2], &[10, 11, 12]]);
        let colour = Image::filled(2, 1, [1, 2, 3]);
        assert_eq!(colour.channels(), [1, 2, 3, 1, 2, 3]);
    }

    #[test]
    fn the_number_of_pixels_must_match() {
        assert!(Image::new(2, 2, vec![0_u16; 4]).is_ok());
        let error = Image::new(2, 2, vec![0_u16; 3]).unwrap_err();
        assert_eq!(error.to_string(), "an image of 2x2 pixels cannot be made from 3 pixels");
        assert!(Image::new(usize::MAX, 2, vec![0_u16; 3]).is_err());
    }
}
