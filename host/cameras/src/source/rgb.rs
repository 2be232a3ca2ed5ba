//! Pictures of devices and senders that write red first.

/// Returns the pixels (blue, green, red) of `bytes`, which hold red, green and blue of each pixel.
pub fn pixels(bytes: &[u8]) -> Vec<[u8; 3]> {
    bytes.as_chunks().0.iter().map(|&[r, g, b]| [b, g, r]).collect()
}
