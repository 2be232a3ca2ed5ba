//! Decoding of images: PNG and JPEG. Images that are too large are refused before they are decoded.
//!
//! A PNG file of 100 kB may have 30000 x 30000 pixels, which take gigabytes when decoded.

use opencv::core::{
    CV_8UC3, CV_16UC1, DataType, Mat, MatTraitConst, MatTraitConstManual, Vec3b, Vector,
};
use opencv::imgcodecs::{IMREAD_ANYCOLOR, IMREAD_ANYDEPTH, IMREAD_UNCHANGED, imdecode};
use plumb_frame::image::{ColourImage, DepthImage, Image, ImageError, ImageSize};
use thiserror::Error;

/// Most pixels of an image. Colour and depth of that size take 250 MB.
pub const MAX_PIXELS: u64 = 50_000_000;

/// Failure to decode an image.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes are no image, or a damaged one.
    #[error("not a picture (PNG or JPEG), or a damaged one")]
    Damaged,
    /// A JPEG image has no end. Some decoders fill its missing rows with those of another image.
    #[error("a part of the JPEG picture is missing: it has no end (the bytes ff d9)")]
    Truncated,
    /// The image has too many pixels.
    #[error("{size} pixels; at most {MAX_PIXELS} are decoded")]
    TooManyPixels {
        /// Size of the image.
        size: ImageSize,
    },
    /// The pixels have another type than the frame needs.
    #[error("{must}")]
    PixelType {
        /// Required type.
        must: &'static str,
    },
    /// The image has another size than it must have.
    #[error("a picture of {size}, but it must be {expected}")]
    OtherSize {
        /// Size of the image.
        size: ImageSize,
        /// Required size.
        expected: ImageSize,
    },
    /// The decoded image has another number of pixels than its size.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Decodes a colour image (8-bit, three channels).
///
/// # Errors
/// Where the bytes are neither PNG nor JPEG, damaged or truncated; where the image is larger than
/// [`MAX_PIXELS`], or its pixels have another type.
pub fn colour(bytes: &[u8]) -> Result<ColourImage, DecodeError> {
    let mat = matrix(bytes, IMREAD_ANYCOLOR | IMREAD_ANYDEPTH)?;
    if mat.typ() != CV_8UC3 {
        return Err(DecodeError::PixelType { must: "the colour picture must be 8-bit BGR" });
    }
    image(&mat, |pixel: &Vec3b| pixel.0)
}

/// Decodes a depth image (16-bit, one channel).
///
/// # Errors
/// As [`colour`].
pub fn depth(bytes: &[u8]) -> Result<DepthImage, DecodeError> {
    let mat = matrix(bytes, IMREAD_UNCHANGED)?;
    if mat.typ() != CV_16UC1 {
        let must = "the depth picture must be 16-bit with one channel";
        return Err(DecodeError::PixelType { must });
    }
    image(&mat, |&pixel: &u16| pixel)
}

/// Copies the pixels of a decoded image.
fn image<T: DataType, P: Copy>(
    mat: &Mat,
    pixel: impl Fn(&T) -> P,
) -> Result<Image<P>, DecodeError> {
    let damaged = |_| DecodeError::Damaged;
    let pixels = mat.data_typed::<T>().map_err(damaged)?.iter().map(pixel).collect();
    Ok(Image::new(mat.cols() as usize, mat.rows() as usize, pixels)?)
}

/// Decodes an image. `flags` are those of OpenCV's `imread`.
fn matrix(bytes: &[u8], flags: i32) -> Result<Mat, DecodeError> {
    let size = size(bytes).ok_or(DecodeError::Damaged)?;
    if size.width as u64 * size.height as u64 > MAX_PIXELS {
        return Err(DecodeError::TooManyPixels { size });
    }
    if jpeg_frame(bytes).is_some_and(|(_, rest)| !has_end(rest)) {
        return Err(DecodeError::Truncated);
    }
    let mat =
        imdecode(&Vector::<u8>::from_slice(bytes), flags).map_err(|_| DecodeError::Damaged)?;
    if mat.empty() { Err(DecodeError::Damaged) } else { Ok(mat) }
}

/// Returns the size in the header of an image; `None` where the bytes are neither PNG nor JPEG, or
/// damaged.
pub fn size(bytes: &[u8]) -> Option<ImageSize> {
    let size = png_size(bytes).or_else(|| jpeg_frame(bytes).map(|(size, _)| size));
    size.filter(|size| size.width > 0 && size.height > 0)
}

/// PNG (RFC 2083): the signature and the length and name of the first chunk, which is the header.
const PNG_START: &[u8; 16] = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR";

/// Returns the size of a PNG image.
fn png_size(bytes: &[u8]) -> Option<ImageSize> {
    let (header, _) = bytes.strip_prefix(PNG_START)?.split_first_chunk::<8>()?;
    let [w0, w1, w2, w3, h0, h1, h2, h3] = *header;
    Some(ImageSize {
        width: u32::from_be_bytes([w0, w1, w2, w3]) as usize,
        height: u32::from_be_bytes([h0, h1, h2, h3]) as usize,
    })
}

/// Returns the size of a JPEG image (ITU-T T.81), and the bytes after it: segments of a marker and
/// a length stand before the frame header (SOF), which has the size.
fn jpeg_frame(bytes: &[u8]) -> Option<(ImageSize, &[u8])> {
    let mut rest = bytes.strip_prefix(b"\xff\xd8")?;
    loop {
        // Any number of bytes 0xff stands before a marker.
        let fill = rest.iter().take_while(|&&byte| byte == 0xff).count();
        let (&marker, segment) = rest.get(fill..).filter(|_| fill > 0)?.split_first()?;
        let (&[high, low], body) = segment.split_first_chunk::<2>()?;
        let length = usize::from(u16::from_be_bytes([high, low])).checked_sub(2)?;
        match marker {
            // Define Huffman table, JPEG extension and define arithmetic coding share the frame
            // headers' range.
            0xc4 | 0xc8 | 0xcc => {}
            0xc0..=0xcf => {
                let (&[_precision, h0, h1, w0, w1], rest) = body.split_first_chunk::<5>()?;
                let [width, height] =
                    [[w0, w1], [h0, h1]].map(|bytes| usize::from(u16::from_be_bytes(bytes)));
                return Some((ImageSize { width, height }, rest));
            }
            // Start of scan, markers without a length: there is no frame header before the pixels.
            0x00..=0x01 | 0xd0..=0xda => return None,
            _ => {}
        }
        rest = body.get(length..)?;
    }
}

/// Checks whether the end of a JPEG image (EOI) is in the bytes after its frame header. Some
/// cameras send further bytes after the end. These two bytes do not occur among the pixels: behind
/// 0xff there is 0 or a restart marker there.
fn has_end(rest: &[u8]) -> bool {
    rest.windows(2).rev().any(|bytes| bytes == b"\xff\xd9")
}

#[cfg(test)]
mod tests {
    use opencv::core::Scalar;
    use opencv::imgcodecs::{IMWRITE_JPEG_PROGRESSIVE, imencode};

    use super::*;

    fn encoded(extension: &str, typ: i32, options: &[i32]) -> Vec<u8> {
        let mat = Mat::new_rows_cols_with_default(24, 32, typ, Scalar::all(7.0)).unwrap();
        let mut bytes = Vector::<u8>::new();
        imencode(extension, &mat, &mut bytes, &Vector::from_slice(options)).unwrap();
        bytes.as_slice().to_vec()
    }

    #[test]
    fn the_size_is_read_from_the_header() {
        for bytes in [
            encoded(".png", CV_8UC3, &[]),
            encoded(".png", CV_16UC1, &[]),
            encoded(".jpg", CV_8UC3, &[]),
            encoded(".jpg", CV_8UC3, &[IMWRITE_JPEG_PROGRESSIVE, 1]),
        ] {
            assert_eq!(size(&bytes), Some(ImageSize { width: 32, height: 24 }));
            // Wherever the header is cut there is no size, and no panic.
            let header = (0..bytes.len()).find(|&length| size(&bytes[..length]).is_some()).unwrap();
            assert!((20..bytes.len()).contains(&header), "{header}");
        }
        for other in [
            &b""[..],
            b"\xff\xd8",
            b"\xff\xd8\xff\xda\0\x02",
            b"\x89PNG\r\n\x1a\n",
            b"P6 32 24 255 ",
        ] {
            assert_eq!(size(other), None, "{other:?}");
        }
    }

    #[test]
    fn a_picture_without_its_end_is_refused() {
        let jpeg = encoded(".jpg", CV_8UC3, &[]);
        let padded = [&jpeg[..], &[0; 9]].concat();
        assert!([&jpeg, &padded].into_iter().all(|bytes| colour(bytes).is_ok()));
        // The end of a small picture in a segment before the frame header is another one.
        let segment = b"\xff\xd8\xff\xe1\x00\x04\xff\xd9";
        let nested = [&segment[..], &jpeg[2..]].concat();
        assert!(colour(&nested).is_ok());
        for bytes in [&jpeg[..jpeg.len() - 2], &nested[..nested.len() - 2]] {
            assert_eq!(colour(bytes), Err(DecodeError::Truncated));
        }
    }

    #[test]
    fn a_picture_that_is_too_large_is_refused_before_it_is_decoded() {
        let mut png = encoded(".png", CV_8UC3, &[]);
        png[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
        let mut jpeg = encoded(".jpg", CV_8UC3, &[]);
        let frame = jpeg.windows(2).position(|bytes| bytes == [0xff, 0xc0]).unwrap();
        jpeg[frame + 5..frame + 9].copy_from_slice(&[0x75, 0x30, 0x75, 0x30]);
        for bytes in [png, jpeg] {
            let error = colour(&bytes).unwrap_err().to_string();
            assert_eq!(error, "30000x30000 pixels; at most 50000000 are decoded");
        }
    }
}
