//! Decoding of netpbm images: PGM and PPM, binary (P5, P6) or as text (P2, P3).

use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};

use super::error::{DecodeError, NO_DEPTH};
use super::samples::{eight_bits, pixels};

/// Header of a netpbm image.
pub(super) struct Header<'a> {
    size: ImageSize,
    /// 1 (grey) or 3 (red, green, blue).
    channels: usize,
    /// Largest value of a sample, at least 1.
    largest: u16,
    /// Samples are decimal numbers.
    is_text: bool,
    /// Samples.
    data: &'a [u8],
}

impl<'a> Header<'a> {
    /// Reads the header of a netpbm image.
    pub(super) fn read(bytes: &'a [u8]) -> Option<Self> {
        let (start, mut rest) = bytes.split_first_chunk::<2>()?;
        let (channels, is_text) = match start {
            b"P2" => (1, true),
            b"P3" => (3, true),
            b"P5" => (1, false),
            b"P6" => (3, false),
            _ => return None,
        };
        let size = ImageSize { width: number(&mut rest)?, height: number(&mut rest)? };
        let largest = u16::try_from(number(&mut rest)?).ok().filter(|&largest| largest > 0)?;
        // One byte separates the header from the samples, which may look like spaces.
        let (_, data) = rest.split_first().filter(|(space, _)| space.is_ascii_whitespace())?;
        Some(Self { size, channels, largest, is_text, data })
    }

    pub(super) fn size(&self) -> ImageSize {
        self.size
    }

    pub(super) fn is_grey(&self) -> bool {
        self.channels == 1
    }

    /// Returns the number of samples. The size is known to be within bounds.
    fn count(&self) -> usize {
        self.size.width * self.size.height * self.channels
    }

    /// Returns the samples, converted. No memory is taken for samples that are missing.
    fn samples<T>(&self, convert: impl Fn(u16) -> T) -> Result<Vec<T>, DecodeError> {
        let (count, mut rest) = (self.count(), self.data);
        let bytes = match (self.is_text, self.largest) {
            // A number has a digit, and a space before the next one.
            (true, _) => 2 * count - 1,
            (false, ..=255) => count,
            (false, _) => 2 * count,
        };
        let data = self.data.get(..bytes).ok_or(DecodeError::Damaged)?;
        let valid = |sample: u16| (sample <= self.largest).then(|| convert(sample));
        let samples: Option<Vec<T>> = match (self.is_text, self.largest) {
            (true, _) => (0..count)
                .map(|_| number(&mut rest).and_then(|sample| valid(sample.try_into().ok()?)))
                .collect(),
            (false, ..=255) => data.iter().map(|&sample| valid(sample.into())).collect(),
            (false, _) => {
                let samples = data.as_chunks().0.iter();
                samples.map(|&sample| valid(u16::from_be_bytes(sample))).collect()
            }
        };
        samples.ok_or(DecodeError::Damaged)
    }
}

/// Takes a decimal number from the front of `bytes`, with the spaces and comments before it.
fn number(bytes: &mut &[u8]) -> Option<usize> {
    loop {
        *bytes = bytes.trim_ascii_start();
        if bytes.first() != Some(&b'#') {
            break;
        }
        let end = bytes.iter().position(|&byte| byte == b'\n')?;
        *bytes = &bytes[end..];
    }
    let digits = bytes.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (number, rest) = bytes.split_at(digits);
    *bytes = rest;
    std::str::from_utf8(number).ok()?.parse().ok()
}

/// Decodes a colour image.
pub(super) fn colour(header: &Header<'_>) -> Result<ColourImage, DecodeError> {
    let samples = header.samples(|sample| eight_bits(sample, header.largest))?;
    let ImageSize { width, height } = header.size;
    Ok(Image::new(width, height, pixels(&samples, header.channels))?)
}

/// Decodes a depth image. The largest value that the header states scales nothing.
pub(super) fn depth(header: &Header<'_>) -> Result<DepthImage, DecodeError> {
    if header.channels != 1 || header.largest <= 255 {
        return Err(NO_DEPTH);
    }
    let ImageSize { width, height } = header.size;
    Ok(Image::new(width, height, header.samples(|sample| sample)?)?)
}
