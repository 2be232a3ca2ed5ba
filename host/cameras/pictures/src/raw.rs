//! Pixels of bytes without a format, as devices and senders deliver them, and depth in other units.

use plumb_frame::image::{Bgr, DepthImage};

/// Returns the pixels (blue, green, red) of `bytes`, which hold red, green and blue of each pixel.
/// Bytes after the last whole pixel are left out.
pub fn bgr_of_rgb(bytes: &[u8]) -> Vec<Bgr> {
    bytes.as_chunks().0.iter().map(|&[r, g, b]| [b, g, r]).collect()
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
