//! Colours of the image at a place on each ray.
//!
//! The loops over the rays that compute are apart from those that read pixels, so that the compiler
//! computes many rays at once.

use multiversion::multiversion;

use super::pyramid::mixed;
use crate::image::Bgr;

/// Number of rays.
pub const RAYS: usize = 40;

/// Colours at a point on each ray, channel by channel: blue, green, red, 0 to 255.
pub(super) type RayColours = [[f32; RAYS]; 3];

/// A pixel and its right neighbour, for a place on each ray.
#[derive(Clone, Copy)]
struct Pairs {
    /// Four bytes from the left pixel on.
    left: [u32; RAYS],
    /// Four bytes to the end of the right pixel.
    right: [u32; RAYS],
}

impl Pairs {
    /// Reads the pair of a ray that starts at this byte.
    #[inline(always)]
    fn read(&mut self, ray: usize, bytes: &[u8], start: usize) {
        let pixels = &bytes[start..start + 6];
        self.left[ray] = u32::from_le_bytes(*pixels.first_chunk().unwrap_or(&[0; 4]));
        self.right[ray] = u32::from_le_bytes(*pixels.last_chunk().unwrap_or(&[0; 4]));
    }

    /// Returns a channel of both pixels of a ray.
    #[inline(always)]
    fn channel(&self, ray: usize, channel: u32) -> [f32; 2] {
        let byte = |bytes: u32, k: u32| (bytes >> (8 * k) & 255) as i32 as f32;
        [byte(self.left[ray], channel), byte(self.right[ray], channel + 1)]
    }
}

/// Reads the colours at these columns and rows between the pixels of an image, whose `bytes` have
/// `width` columns. A place outside is moved into the image.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn read_between(
    bytes: &[u8],
    width: usize,
    [columns, rows]: &[[f64; RAYS]; 2],
    colours: &mut RayColours,
) {
    let (mut starts, mut rights, mut downs) = ([0; RAYS], [0.0; RAYS], [0.0; RAYS]);
    for ray in 0..RAYS {
        let (column, row) = (columns[ray] as i32, rows[ray] as i32);
        rights[ray] = (columns[ray] - f64::from(column)) as f32;
        downs[ray] = (rows[ray] - f64::from(row)) as f32;
        starts[ray] = row.wrapping_mul(width as i32).wrapping_add(column).wrapping_mul(3);
    }
    // The last pair of pixels that has another pair below it.
    let below = 3 * width;
    let last = bytes.len() - below - 6;
    let [mut upper, mut lower] = [Pairs { left: [0; RAYS], right: [0; RAYS] }; 2];
    for (ray, &start) in starts.iter().enumerate() {
        let start = usize::try_from(start).unwrap_or(0).min(last);
        upper.read(ray, bytes, start);
        lower.read(ray, bytes, start + below);
    }
    for (channel, colours) in colours.iter_mut().enumerate() {
        for ray in 0..RAYS {
            let [above, below] = [&upper, &lower].map(|pairs| pairs.channel(ray, channel as u32));
            let left = mixed(above[0], below[0], downs[ray]);
            let right = mixed(above[1], below[1], downs[ray]);
            colours[ray] = mixed(left, right, rights[ray]);
        }
    }
}

/// Reads the colours of the pixels nearest to these columns and rows of an image of `size`, columns
/// and rows. A ray that is not `inside` the image any more stays outside.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn read_nearest(
    pixels: &[Bgr],
    size: (usize, usize),
    [columns, rows]: &[[f64; RAYS]; 2],
    inside: &mut [bool; RAYS],
    colours: &mut RayColours,
) {
    let (width, height) = (size.0 as f64, size.1 as f64);
    let mut places = [0; RAYS];
    for ray in 0..RAYS {
        let (x, y) = (columns[ray] + 0.5, rows[ray] + 0.5);
        inside[ray] &= (x >= 0.0) & (y >= 0.0) & (x < width) & (y < height);
        let place = (y as i32).wrapping_mul(size.0 as i32).wrapping_add(x as i32);
        places[ray] = if inside[ray] { place } else { 0 };
    }
    let mut bytes = [[0; RAYS]; 3];
    for (ray, &place) in places.iter().enumerate() {
        let pixel = pixels[place as usize];
        (bytes[0][ray], bytes[1][ray], bytes[2][ray]) = (pixel[0], pixel[1], pixel[2]);
    }
    for (colours, bytes) in colours.iter_mut().zip(&bytes) {
        for (colour, &byte) in colours.iter_mut().zip(bytes) {
            *colour = f32::from(byte);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_that_has_left_the_image_stays_outside() {
        let pixels = [[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12], [13, 14, 15], [16, 17, 18]];
        let (mut inside, mut colours) = ([true; RAYS], [[0.0; RAYS]; 3]);
        let mut places = [[0.4; RAYS]; 2];
        // Of the rays 1 to 5 only the first is in the image; the columns are 3, the rows 2.
        for (ray, place) in [(2.4, 1.4), (2.6, 0.0), (0.0, 1.6), (-0.6, 0.0), (f64::NAN, 0.0)]
            .into_iter()
            .enumerate()
        {
            (places[0][ray + 1], places[1][ray + 1]) = place;
        }
        read_nearest(&pixels, (3, 2), &places, &mut inside, &mut colours);
        assert_eq!(inside[..7], [true, true, false, false, false, false, true]);
        assert_eq!(
            colours.map(|channel| [channel[0], channel[1]]),
            [[1.0, 16.0], [2.0, 17.0], [3.0, 18.0]]
        );
        read_nearest(&pixels, (3, 2), &[[1.0; RAYS]; 2], &mut inside, &mut colours);
        assert_eq!(inside[..7], [true, true, false, false, false, false, true]);
        assert_eq!(colours.map(|channel| channel[6]), [13.0, 14.0, 15.0]);
    }
}
