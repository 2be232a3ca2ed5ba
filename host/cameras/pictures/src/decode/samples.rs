//! Pixels from the samples of a file.

use plumb_frame::image::Bgr;

/// Scales a sample of 0 to `largest` to 8 bits, rounded.
pub(super) fn eight_bits(sample: u16, largest: u16) -> u8 {
    ((u32::from(sample) * 255 + u32::from(largest) / 2) / u32::from(largest)) as u8
}

/// Returns the pixels of 8-bit samples: grey (1 channel), grey and alpha (2), red, green and blue
/// (3), or these and alpha (4).
pub(super) fn pixels(samples: &[u8], channels: usize) -> Vec<Bgr> {
    match channels {
        1 => samples.iter().map(|&grey| [grey; 3]).collect(),
        2 => samples.as_chunks().0.iter().map(|&[grey, _]| [grey; 3]).collect(),
        3 => samples.as_chunks().0.iter().map(|&[r, g, b]| [b, g, r]).collect(),
        _ => samples.as_chunks().0.iter().map(|&[r, g, b, _]| [b, g, r]).collect(),
    }
}
