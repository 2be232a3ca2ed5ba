//! Decoding of PNG images (RFC 2083).

use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, Decoder, InterlaceInfo, Reader, Transformations, expand_interlaced_row,
};
use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};

use super::error::{DecodeError, NO_DEPTH};
use super::samples::{eight_bits, pixels};

/// The signature and the length and name of the first chunk, which is the header.
const START: &[u8; 16] = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR";

/// Returns the size of a PNG image.
pub(super) fn size(bytes: &[u8]) -> Option<ImageSize> {
    let (header, _) = bytes.strip_prefix(START)?.split_first_chunk::<8>()?;
    let [w0, w1, w2, w3, h0, h1, h2, h3] = *header;
    Some(ImageSize {
        width: u32::from_be_bytes([w0, w1, w2, w3]) as usize,
        height: u32::from_be_bytes([h0, h1, h2, h3]) as usize,
    })
}

/// Returns whether the header of a PNG image states grey, with alpha or without.
pub(super) fn is_grey(bytes: &[u8]) -> bool {
    // After width, height and bits.
    let kind = bytes.get(START.len() + 9).copied();
    [ColorType::Grayscale, ColorType::GrayscaleAlpha].iter().any(|grey| kind == Some(*grey as u8))
}

/// Decodes a colour image of `size`.
pub(super) fn colour(bytes: &[u8], size: ImageSize) -> Result<ColourImage, DecodeError> {
    // Fewer than 8 bits and palettes are expanded to 8 bits.
    let mut reader = reader(bytes, size, Transformations::EXPAND)?;
    let (kind, depth) = reader.output_color_type();
    let channels = kind.samples();
    let wide = |sample: &[u8; 2]| eight_bits(u16::from_be_bytes(*sample), u16::MAX);
    let image = rows(&mut reader, size, |row| match depth {
        BitDepth::Sixteen => {
            pixels(&row.as_chunks().0.iter().map(wide).collect::<Vec<u8>>(), channels)
        }
        _ => pixels(row, channels),
    })?;
    Ok(Image::new(size.width, size.height, image)?)
}

/// Decodes a depth image of `size`.
pub(super) fn depth(bytes: &[u8], size: ImageSize) -> Result<DepthImage, DecodeError> {
    let mut reader = reader(bytes, size, Transformations::IDENTITY)?;
    if reader.output_color_type() != (ColorType::Grayscale, BitDepth::Sixteen) {
        return Err(NO_DEPTH);
    }
    let image = rows(&mut reader, size, |row| row.as_chunks().0.to_vec())?;
    let image = image.into_iter().map(u16::from_be_bytes).collect();
    Ok(Image::new(size.width, size.height, image)?)
}

/// Returns a reader of the rows of an image of `size`. Texts and profiles are not unpacked.
fn reader(
    bytes: &[u8],
    size: ImageSize,
    transformations: Transformations,
) -> Result<Reader<Cursor<&[u8]>>, DecodeError> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(transformations);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let reader = decoder.read_info().map_err(|_| DecodeError::Damaged)?;
    // The first picture of an animation may be a part of the image.
    let info = reader.info();
    let first = info.frame_control.map_or(info.size(), |part| (part.width, part.height));
    let is_whole = (first.0 as usize, first.1 as usize) == (size.width, size.height);
    if is_whole { Ok(reader) } else { Err(DecodeError::Damaged) }
}

/// Reads all rows, and then the file up to its end. `convert` returns the pixels of a row.
fn rows<const N: usize>(
    reader: &mut Reader<Cursor<&[u8]>>,
    size: ImageSize,
    convert: impl Fn(&[u8]) -> Vec<[u8; N]>,
) -> Result<Vec<[u8; N]>, DecodeError> {
    let mut image = vec![[0; N]; size.width * size.height];
    let mut count = 0;
    while let Some(row) = reader.next_interlaced_row().map_err(|_| DecodeError::Damaged)? {
        let pixels = convert(row.data());
        match row.interlace() {
            InterlaceInfo::Null(_) => {
                let place = image.get_mut(count * size.width..(count + 1) * size.width);
                place.ok_or(DecodeError::Damaged)?.copy_from_slice(&pixels);
            }
            InterlaceInfo::Adam7(pass) => {
                let (image, pixels) = (image.as_flattened_mut(), pixels.as_flattened());
                expand_interlaced_row(image, N * size.width, pixels, pass, 8 * N as u8);
            }
        }
        count += 1;
    }
    reader.finish().map_err(|_| DecodeError::Damaged)?;
    Ok(image)
}
