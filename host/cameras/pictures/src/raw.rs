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
pub fn depth_of_millimetres(bytes: &[u8], is_little: bool) -> Vec<u16> {
    let number = if is_little { u16::from_le_bytes } else { u16::from_be_bytes };
    let known = |value| if value == u16::MAX { 0 } else { value };
    bytes.as_chunks().0.iter().map(|&bytes| known(number(bytes))).collect()
}

/// Returns the depth values (millimetres) of `bytes`, metres in four bytes each, the lower one
/// first where `is_little`. What is no number, not above 0 or beyond 65.534 m becomes 0, unknown.
/// Bytes after the last whole value are left out.
pub fn depth_of_metres(bytes: &[u8], is_little: bool) -> Vec<u16> {
    let number = if is_little { f32::from_le_bytes } else { f32::from_be_bytes };
    let millimetres = |metres: f32| {
        let value = (f64::from(metres) * 1e3).round();
        if (0.0..f64::from(u16::MAX)).contains(&value) { value as u16 } else { 0 }
    };
    bytes.as_chunks().0.iter().map(|&bytes| millimetres(number(bytes))).collect()
}

/// Returns the depth values of `bytes`, two each, the lower one first. A byte after the last whole
/// value is left out.
pub fn depth_of_little_endian(bytes: &[u8]) -> Vec<u16> {
    bytes.as_chunks().0.iter().map(|&value| u16::from_le_bytes(value)).collect()
}

/// Multiplies the depth values. A product out of range (beyond 65535) becomes 0, unknown.
pub fn multiplied(depth: &DepthImage, factor: u16) -> DepthImage {
    let mut depth = depth.clone();
    if factor != 1 {
        for value in depth.pixels_mut() {
            *value = value.checked_mul(factor).unwrap_or(0);
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
        assert_eq!(depth_of_millimetres(&[0x12, 0x34, 0xff, 0xff, 1], false), [0x1234, 0]);
    }
}
