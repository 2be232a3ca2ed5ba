//! Decoding of JPEG images (ITU-T T.81): baseline and progressive, grey or three colours.

use std::borrow::Cow;

use plumb_frame::image::{ColourImage, Image, ImageSize};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::error::DecodeError;

/// Most scans of a progressive image. Encoders write about 10.
const MAX_SCANS: usize = 100;

/// Start of an image (SOI).
const START: &[u8; 2] = b"\xff\xd8";

/// A segment APP0 of an AVI file. In pictures of such files the Huffman tables are left out, and
/// the decoder uses the standard ones (T.81, K.3).
const AVI_SEGMENT: &[u8] = b"\xff\xe0\x00\x10AVI1\0\0\0\0\0\0\0\0\0\0";

/// What stands before the pixels of an image.
pub(super) struct Header<'a> {
    size: ImageSize,
    /// Number of its colours: 1 is grey.
    colours: u8,
    /// Why the image is not decoded.
    unusual: Option<&'static str>,
    has_huffman_tables: bool,
    /// The bytes after the size.
    rest: &'a [u8],
}

impl<'a> Header<'a> {
    /// Reads the segments before the pixels: a marker, a length and a body each.
    pub(super) fn read(bytes: &'a [u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(START)?;
        let (mut frame, mut has_huffman_tables) = (None, false);
        loop {
            // Any number of bytes 0xff stands before a marker.
            let fill = rest.iter().take_while(|&&byte| byte == 0xff).count();
            let (&marker, segment) = rest.get(fill..).filter(|_| fill > 0)?.split_first()?;
            let (&[high, low], body) = segment.split_first_chunk::<2>()?;
            let length = usize::from(u16::from_be_bytes([high, low])).checked_sub(2)?;
            match marker {
                // Define Huffman table.
                0xc4 => has_huffman_tables = true,
                // JPEG extension and define arithmetic coding share the frame headers' range.
                0xc8 | 0xcc => {}
                0xc0..=0xcf if frame.is_none() => frame = Some((marker, body)),
                // Start of scan: the pixels follow.
                0xda => break,
                // Markers without a length: there is no header.
                0x00..=0x01 | 0xd0..=0xd9 => return None,
                _ => {}
            }
            rest = body.get(length..)?;
        }
        let (marker, body) = frame?;
        let (&[precision, h0, h1, w0, w1, colours], rest) = body.split_first_chunk::<6>()?;
        let [width, height] =
            [[w0, w1], [h0, h1]].map(|bytes| usize::from(u16::from_be_bytes(bytes)));
        let unusual = unusual(marker, precision, colours);
        let size = ImageSize { width, height };
        Some(Self { size, colours, unusual, has_huffman_tables, rest })
    }

    pub(super) fn is_grey(&self) -> bool {
        self.colours == 1
    }

    pub(super) fn size(&self) -> ImageSize {
        self.size
    }

    /// Checks whether the end of the image (EOI) is in the bytes after its size. Some cameras send
    /// further bytes after the end. These two bytes do not occur among the pixels: behind 0xff
    /// there is 0 or a restart marker there.
    fn has_end(&self) -> bool {
        self.rest.windows(2).rev().any(|bytes| bytes == b"\xff\xd9")
    }
}

/// Returns what an image is that is not decoded, of the marker of its frame header, the bits of
/// its samples and the number of its colours.
fn unusual(marker: u8, precision: u8, colours: u8) -> Option<&'static str> {
    match (marker, precision, colours) {
        (0xc9..=0xcf, ..) => Some("with arithmetic coding"),
        (0xc3 | 0xc7, ..) => Some("of the lossless kind"),
        (0xc5 | 0xc6, ..) => Some("of the hierarchical kind"),
        (_, 12, _) => Some("of 12 bits"),
        (.., 4) => Some("of 4 colours (CMYK)"),
        _ => None,
    }
}

/// Decodes a colour image with this header. Damage is an error where the decoder notices it.
pub(super) fn colour(bytes: &[u8], header: &Header<'_>) -> Result<ColourImage, DecodeError> {
    if !header.has_end() {
        return Err(DecodeError::Truncated);
    }
    if let Some(kind) = header.unusual {
        return Err(DecodeError::OtherJpeg { kind });
    }
    let bytes = if header.has_huffman_tables {
        Cow::Borrowed(bytes)
    } else {
        Cow::Owned([START, AVI_SEGMENT, &bytes[START.len()..]].concat())
    };
    let options = DecoderOptions::new_fast()
        .set_max_width(header.size.width)
        .set_max_height(header.size.height)
        .set_strict_mode(true)
        .jpeg_set_max_scans(MAX_SCANS)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&*bytes), options);
    decoder.decode_headers().map_err(|_| DecodeError::Damaged)?;
    let ImageSize { width, height } = header.size;
    let mut pixels = vec![[0; 3]; width * height];
    let samples = pixels.as_flattened_mut();
    if decoder.output_buffer_size() != Some(samples.len()) {
        return Err(DecodeError::Damaged);
    }
    decoder.decode_into(samples).map_err(|_| DecodeError::Damaged)?;
    for pixel in &mut pixels {
        pixel.swap(0, 2);
    }
    Ok(Image::new(width, height, pixels)?)
}
