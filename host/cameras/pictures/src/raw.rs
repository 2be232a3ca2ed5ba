//! Pixels of bytes without a format, as devices and senders deliver them, and depth in other units.

use plumb_frame::image::{Bgr, DepthImage};

/// Returns the pixels (blue, green, red) of `bytes`, which hold red, green and blue of each pixel.
/// Bytes after the last whole pixel are left out.
pub fn bgr_of_rgb(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().map(|&[r, g, b]| [b, g, r]).collect()
}

/// Returns the pixels of `bytes`, which hold red, green, blue and alpha of each pixel. Alpha and
/// the bytes after the last whole pixel are left out.
pub fn bgr_of_rgba(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().map(|&[r, g, b, _]| [b, g, r]).collect()
}

/// Returns the pixels of `bytes`, which hold blue, green, red and alpha of each pixel. Alpha and
/// the bytes after the last whole pixel are left out.
pub fn bgr_of_bgra(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().map(|&[b, g, r, _]| [b, g, r]).collect()
}

/// Returns the pixels of `bytes`, which hold u, y, v, y of each two pixels (ITU-R BT.601, luma 16
/// to 235). Bytes after the last whole pair are left out.
pub fn bgr_of_uyvy(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().flat_map(|&[u, a, v, b]| [bgr(a, u, v), bgr(b, u, v)]).collect()
}

/// As [`bgr_of_uyvy`], of bytes in the order y, u, y, v.
pub fn bgr_of_yuyv(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().flat_map(|&[a, u, b, v]| [bgr(a, u, v), bgr(b, u, v)]).collect()
}

/// Returns the pixel of luma and chroma (ITU-R BT.601, the inverse of its section 2.5.3, 8 bits).
fn bgr(y: u8, u: u8, v: u8) -> Bgr {
    let luma = 1.164_384 * (f32::from(y) - 16.0);
    let (u, v) = (f32::from(u) - 128.0, f32::from(v) - 128.0);
    let (b, g, r) =
        (luma + 2.017_232 * u, luma - 0.391_762 * u - 0.812_968 * v, luma + 1.596_027 * v);
    // The cast saturates.
    [b, g, r].map(|value| value.round() as u8)
}

/// Returns the depth values of `bytes`, two each, the lower one first where `is_little`. 65535,
/// which some cameras send for an unknown depth, becomes 0. A byte after the last whole value is
/// left out.
pub fn depth_of_numbers(bytes: &[u8], is_little: bool) -> Vec<u16> {
    let number = if is_little { u16::from_le_bytes } else { u16::from_be_bytes };
    bytes.as_chunks().0.iter().map(|&bytes| known(number(bytes))).collect()
}

/// Makes 65535, which some cameras send for an unknown depth, 0.
pub fn known_depth(mut depth: DepthImage) -> DepthImage {
    depth.pixels_mut().iter_mut().for_each(|value| *value = known(*value));
    depth
}

/// Returns a known depth value, and 0 for an unknown one.
fn known(value: u16) -> u16 {
    if value == u16::MAX { 0 } else { value }
}

/// Inverse depth in whole numbers, as ROS's `compressed_depth_image_transport` has it: a number of
/// `scale / depth + offset`, with the depth in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseDepth {
    /// Scale, metres, above 0.
    pub scale: f32,
    /// Offset.
    pub offset: f32,
}

impl InverseDepth {
    /// Returns the depth (millimetres) of an image of such numbers. 0, and what is no depth above 0
    /// and below 65.535 m, becomes 0, unknown.
    pub fn millimetres(self, mut numbers: DepthImage) -> DepthImage {
        for value in numbers.pixels_mut().iter_mut().filter(|value| **value != 0) {
            *value = millimetres(self.scale / (f32::from(*value) - self.offset));
        }
        numbers
    }
}

/// Returns the depth values (millimetres) of `bytes`, metres in four bytes each, the lower one
/// first where `is_little`. What is no number, not above 0 or beyond 65.534 m becomes 0, unknown.
/// Bytes after the last whole value are left out.
pub fn depth_of_metres(bytes: &[u8], is_little: bool) -> Vec<u16> {
    let number = if is_little { f32::from_le_bytes } else { f32::from_be_bytes };
    bytes.as_chunks().0.iter().map(|&bytes| millimetres(number(bytes))).collect()
}

/// Converts metres to millimetres. What is no number, not above 0 or beyond 65.534 m becomes 0.
fn millimetres(metres: f32) -> u16 {
    let value = (f64::from(metres) * 1e3).round();
    if (0.0..f64::from(u16::MAX)).contains(&value) { value as u16 } else { 0 }
}

/// Multiplies the depth values. A product out of range (beyond 65534) becomes 0, unknown.
pub fn multiplied(depth: &DepthImage, factor: u16) -> DepthImage {
    let mut depth = depth.clone();
    if factor != 1 {
        for value in depth.pixels_mut() {
            *value = known(value.saturating_mul(factor));
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of the colour bars of ITU-R BT.601 at full amplitude, within rounding.
    #[test]
    fn luma_and_chroma_become_colours() {
        for (yuv, rgb) in [
            ([16, 128, 128], [0, 0, 0]),
            ([235, 128, 128], [255, 255, 255]),
            ([81, 90, 240], [255, 0, 0]),
            ([145, 54, 34], [0, 255, 0]),
            ([41, 240, 110], [0, 0, 255]),
        ] {
            let [y, u, v] = yuv;
            for pixels in [bgr_of_uyvy(&[u, y, v, y]), bgr_of_yuyv(&[y, u, y, v])] {
                let [b, g, r] = pixels[1];
                let near = |(a, b): (u8, u8)| a.abs_diff(b) <= 1;
                assert!([r, g, b].into_iter().zip(rgb).all(near), "{yuv:?}: {pixels:?}");
            }
        }
    }

    #[test]
    fn metres_become_millimetres_and_what_is_no_depth_is_unknown() {
        let metres = [1.5, f32::NAN, f32::INFINITY, -1.0, 0.0, 65.534, 65.535, 1e9];
        let expected = [1500, 0, 0, 0, 0, 65_534, 0, 0];
        assert_eq!(depth_of_metres(&metres.map(f32::to_le_bytes).concat(), true), expected);
        assert_eq!(depth_of_metres(&metres.map(f32::to_be_bytes).concat(), false), expected);
        assert_eq!(depth_of_numbers(&[0x12, 0x34, 0xff, 0xff, 1], false), [0x1234, 0]);
    }

    #[test]
    fn inverse_depth_becomes_millimetres() {
        // Depth of 2, 4 and 0.5 m with ROS's usual parameters: a quantisation of 100, up to 10 m.
        let (scale, offset) = (100.0 * 101.0, 1.0 - 100.0 * 101.0 / 10.0);
        let number = |depth: f32| (scale / depth + offset).round() as u16;
        let numbers = [number(2.0), number(4.0), 0, number(0.5), number(10.0)];
        let image = DepthImage::new(5, 1, numbers.to_vec()).unwrap();
        let depth = InverseDepth { scale, offset }.millimetres(image);
        let worst = [2000, 4000, 0, 500, 9990].iter().zip(depth.pixels());
        assert!(worst.clone().all(|(a, b): (&u16, &u16)| a.abs_diff(*b) <= 10), "{worst:?}");
        // A number at the offset is at infinity, one below it behind the camera.
        let image = DepthImage::new(3, 1, vec![5, 4, 6]).unwrap();
        let depth = InverseDepth { scale: 3.0, offset: 5.0 }.millimetres(image);
        assert_eq!(depth.pixels(), [0, 0, 3000]);
    }

    #[test]
    fn the_largest_depth_is_unknown() {
        let image = DepthImage::new(3, 1, vec![65_535, 65_534, 0]).unwrap();
        assert_eq!(known_depth(image).pixels(), [0, 65_534, 0]);
    }
}
