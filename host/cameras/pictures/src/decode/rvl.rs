//! Decoding of depth in RVL (A. D. Wilson, "Fast Lossless Depth Image Compression", 2017), as ROS
//! sends it: columns and rows in four bytes each, the lower one first, then words of 32 bits.

use plumb_frame::image::{DepthImage, Image, ImageSize};

use super::error::{DecodeError, MAX_PIXELS};

/// Largest number of bits of a number: those of a run of [`MAX_PIXELS`], in whole nibbles.
const MAX_BITS: u32 = 27;

/// Decodes a depth image in RVL.
///
/// # Errors
/// Where the bytes are damaged or cut off, or the image is larger than [`MAX_PIXELS`].
pub fn rvl_depth(bytes: &[u8]) -> Result<DepthImage, DecodeError> {
    let (columns, bytes) = bytes.split_first_chunk().ok_or(DecodeError::Rvl)?;
    let (rows, words) = bytes.split_first_chunk().ok_or(DecodeError::Rvl)?;
    let (width, height) = (u32::from_le_bytes(*columns), u32::from_le_bytes(*rows));
    let size = ImageSize { width: width as usize, height: height as usize };
    let count = u64::from(width) * u64::from(height);
    if count > MAX_PIXELS {
        return Err(DecodeError::TooManyPixels { size });
    }
    if count == 0 {
        return Err(DecodeError::Rvl);
    }
    let pixels = pixels(words, size.width * size.height)?;
    Ok(Image::new(size.width, size.height, pixels)?)
}

/// Decodes `count` pixels: runs of zeros, each followed by a run of differences to the last pixel
/// that is not 0.
fn pixels(words: &[u8], count: usize) -> Result<Vec<u16>, DecodeError> {
    let mut nibbles = Nibbles::new(words);
    let (mut pixels, mut last) = (vec![0_u16; count], 0_u16);
    let mut rest = pixels.as_mut_slice();
    while !rest.is_empty() {
        let zeros = nibbles.number()? as usize;
        rest = rest.get_mut(zeros..).ok_or(DecodeError::Rvl)?;
        let others = nibbles.number()? as usize;
        if zeros + others == 0 {
            return Err(DecodeError::Rvl);
        }
        let (run, after) = rest.split_at_mut_checked(others).ok_or(DecodeError::Rvl)?;
        for pixel in run {
            // The sign is the lowest bit. The sum wraps, as a difference of 16 bits does.
            let number = nibbles.number()?;
            let difference = (number >> 1) ^ (number & 1).wrapping_neg();
            last = last.wrapping_add(difference as u16);
            *pixel = last;
        }
        rest = after;
    }
    Ok(pixels)
}

/// Four bits at a time, of words of 32 bits whose lower byte comes first, the upper bits first.
struct Nibbles<'a> {
    words: std::slice::Iter<'a, [u8; 4]>,
    word: u32,
    /// Nibbles of the word that are left.
    left: u32,
}

impl<'a> Nibbles<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { words: bytes.as_chunks().0.iter(), word: 0, left: 0 }
    }

    /// Reads a number: three bits in each nibble, the lower ones first. The upper bit of a nibble
    /// says that another one follows.
    fn number(&mut self) -> Result<u32, DecodeError> {
        let (mut number, mut bits) = (0, 0);
        loop {
            if self.left == 0 {
                let word = self.words.next().ok_or(DecodeError::Rvl)?;
                (self.word, self.left) = (u32::from_le_bytes(*word), 8);
            }
            let nibble = self.word >> 28;
            (self.word, self.left) = (self.word << 4, self.left - 1);
            number |= (nibble & 7) << bits;
            if nibble & 8 == 0 {
                return Ok(number);
            }
            bits += 3;
            if bits >= MAX_BITS {
                return Err(DecodeError::Rvl);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of an image of these `nibbles`.
    fn file(width: u32, height: u32, nibbles: &[u32]) -> Vec<u8> {
        let word = |part: &[u32]| {
            (0..8).fold(0, |word, k| word << 4 | part.get(k).copied().unwrap_or_default())
        };
        let words = nibbles.chunks(8).map(word);
        [width, height].into_iter().chain(words).flat_map(u32::to_le_bytes).collect()
    }

    #[test]
    fn runs_and_differences_become_pixels() {
        // 2 zeros; 3 others: +5 (10 = 2, 1), -1 (1), +300 (600 = 0, 3, 1, 1); 1 zero; none.
        let nibbles = [2, 3, 0xa, 1, 1, 0x8, 0xb, 0x9, 1, 1, 0];
        let image = rvl_depth(&file(3, 2, &nibbles)).unwrap();
        assert_eq!(image.size(), ImageSize { width: 3, height: 2 });
        assert_eq!(image.pixels(), [0, 0, 5, 4, 304, 0]);
        // 65535 after 0, as the difference -1.
        assert_eq!(rvl_depth(&file(1, 1, &[0, 1, 1])).unwrap().pixels(), [u16::MAX]);
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let whole = file(3, 2, &[2, 3, 0xa, 1, 1, 0x8, 0xb, 0x9, 1, 1, 0]);
        for length in 0..whole.len() {
            assert_eq!(rvl_depth(&whole[..length]).unwrap_err(), DecodeError::Rvl, "{length}");
        }
        // No pixels, runs beyond the image, endless runs of nothing, a number without an end.
        for (width, nibbles) in
            [(0, &[0; 8][..]), (2, &[3, 0]), (2, &[0, 3, 0, 0, 0]), (2, &[0; 80]), (2, &[0xf; 80])]
        {
            assert_eq!(rvl_depth(&file(width, 1, nibbles)).unwrap_err(), DecodeError::Rvl);
        }
        let huge = rvl_depth(&file(u32::MAX, u32::MAX, &[0; 8])).unwrap_err();
        assert!(matches!(huge, DecodeError::TooManyPixels { .. }), "{huge}");
    }
}
