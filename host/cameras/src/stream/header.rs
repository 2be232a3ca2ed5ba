//! Header of a frame: one line of JSON.

use std::fmt;

use plumb_config::bounded_read::LineError;
use plumb_frame::image::ImageSize;
use serde::Deserialize;
use thiserror::Error;

/// Longest header, bytes, including the end of its line.
pub const MAX_HEADER_BYTES: u64 = 4096;

/// Most columns or rows of a picture.
pub const MAX_SIDE: u32 = 8192;

/// Most pixels of a picture: 16 million, twice those of a 4K camera. Each of the three frames that
/// are in memory at most (received, waiting, decoded) takes 80 MB with depth.
pub const MAX_PIXELS: u64 = 1 << 24;

/// Most bytes of an encoded picture beyond those of its pixels.
const ENCODING_OVERHEAD: u64 = 1 << 16;

/// Largest time stamp, seconds. Time stamps in nanoseconds since 1970 are beyond it.
const MAX_TIME_S: f64 = 1e10;

/// Greatest age of a picture when it is sent, seconds.
const MAX_AGE_S: f64 = 10.0;

/// Smallest and largest depth scale, units in a metre: 1 cm and 10 µm.
const DEPTH_SCALES: [f64; 2] = [100.0, 100_000.0];

/// Encoding of a colour picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourEncoding {
    /// Red, green, blue: three bytes for each pixel.
    Rgb8,
    /// Blue, green, red: three bytes for each pixel.
    Bgr8,
    /// JPEG file.
    Jpeg,
    /// PNG file, 8-bit, three channels.
    Png,
}

/// Encoding of a depth picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DepthEncoding {
    /// Two bytes for each pixel, the lower one first.
    Z16,
    /// PNG file, 16-bit, one channel.
    Png16,
    /// There is no depth.
    #[default]
    None,
}

impl fmt::Display for ColourEncoding {
    /// Writes the name as in a header.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rgb8 => "rgb8",
            Self::Bgr8 => "bgr8",
            Self::Jpeg => "jpeg",
            Self::Png => "png",
        })
    }
}

impl fmt::Display for DepthEncoding {
    /// Writes the name as in a header.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Z16 => "z16",
            Self::Png16 => "png16",
            Self::None => "none",
        })
    }
}

/// Header of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    /// Time of the exposure, seconds on any clock that runs evenly.
    pub(super) t: f64,
    /// Columns.
    width: u32,
    /// Rows.
    height: u32,
    /// Encoding of colour.
    pub(super) colour: ColourEncoding,
    /// Bytes of colour.
    pub(super) colour_bytes: u64,
    /// Encoding of depth.
    #[serde(default)]
    pub(super) depth: DepthEncoding,
    /// Bytes of depth.
    #[serde(default)]
    pub(super) depth_bytes: u64,
    /// Depth units in a metre.
    pub(super) depth_scale: Option<f64>,
    /// Age of the picture when it is sent, seconds.
    #[serde(default)]
    pub(super) age: f64,
}

/// Picture of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Colour.
    Colour,
    /// Depth.
    Depth,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
        })
    }
}

/// Violated condition of a header.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HeaderError {
    /// The line cannot be read, is too long, or is no text.
    #[error("the line with the header")]
    Line(#[source] LineError),
    /// The line is not the JSON of a header.
    #[error("the line with the header is not as documented")]
    Json(#[source] serde_json::Error),
    /// The time stamp is out of its range.
    #[error("`t` is {0}: seconds, within ±1e10 (not milliseconds or nanoseconds)")]
    Time(f64),
    /// The age is out of its range.
    #[error("`age` is {0}: seconds, from 0 to {MAX_AGE_S}")]
    Age(f64),
    /// The size is out of its range.
    #[error("{0} pixels: 1 to {MAX_SIDE} columns and rows, and at most {MAX_PIXELS} pixels")]
    Size(ImageSize),
    /// The bytes of a picture without compression do not fit its size.
    #[error("`{part}_bytes` is {bytes}, but a picture of {size} pixels has {expected} bytes")]
    Bytes {
        /// Picture.
        part: Part,
        /// Bytes that the header states.
        bytes: u64,
        /// Size of the picture.
        size: ImageSize,
        /// Bytes of a picture of that size.
        expected: u64,
    },
    /// An encoded picture is empty, or larger than it can be.
    #[error("`{part}_bytes` is {bytes}: 1 to {limit} for a picture of {size} pixels")]
    EncodedBytes {
        /// Picture.
        part: Part,
        /// Bytes that the header states.
        bytes: u64,
        /// Size of the picture.
        size: ImageSize,
        /// Most bytes.
        limit: u64,
    },
    /// There is no depth, but it has bytes.
    #[error("`depth` is \"none\", but `depth_bytes` is {0}")]
    UnexpectedDepth(u64),
    /// The depth scale is missing or out of its range.
    #[error(
        "`depth_scale` is {}: depth units in a metre, from {} to {} (1000 where depth is in \
         millimetres)",
        .0.map_or("missing".to_owned(), |scale| scale.to_string()),
        DEPTH_SCALES[0],
        DEPTH_SCALES[1]
    )]
    DepthScale(Option<f64>),
}

impl Header {
    /// Parses and checks a line.
    ///
    /// # Errors
    /// Where the line is not a header's JSON, or a value is out of its range.
    pub(super) fn parse(line: &str) -> Result<Self, HeaderError> {
        let header: Self = serde_json::from_str(line).map_err(HeaderError::Json)?;
        header.check()?;
        Ok(header)
    }

    /// Returns columns and rows.
    pub(super) fn size(&self) -> ImageSize {
        ImageSize { width: self.width as usize, height: self.height as usize }
    }

    fn check(&self) -> Result<(), HeaderError> {
        if self.t.abs() > MAX_TIME_S {
            return Err(HeaderError::Time(self.t));
        }
        if !(0.0..=MAX_AGE_S).contains(&self.age) {
            return Err(HeaderError::Age(self.age));
        }
        let (sides, pixels) = (1..=MAX_SIDE, u64::from(self.width) * u64::from(self.height));
        if !(sides.contains(&self.width) && sides.contains(&self.height) && pixels <= MAX_PIXELS) {
            return Err(HeaderError::Size(self.size()));
        }
        let is_raw = matches!(self.colour, ColourEncoding::Rgb8 | ColourEncoding::Bgr8);
        self.check_bytes(Part::Colour, is_raw, self.colour_bytes, 3 * pixels)?;
        if self.depth == DepthEncoding::None {
            return match self.depth_bytes {
                0 => Ok(()),
                bytes => Err(HeaderError::UnexpectedDepth(bytes)),
            };
        }
        if !self.depth_scale.is_some_and(|s| (DEPTH_SCALES[0]..=DEPTH_SCALES[1]).contains(&s)) {
            return Err(HeaderError::DepthScale(self.depth_scale));
        }
        let is_raw = self.depth == DepthEncoding::Z16;
        self.check_bytes(Part::Depth, is_raw, self.depth_bytes, 2 * pixels)
    }

    /// Checks the bytes of a picture, whose pixels take `expected` bytes.
    fn check_bytes(
        &self,
        part: Part,
        is_raw: bool,
        bytes: u64,
        expected: u64,
    ) -> Result<(), HeaderError> {
        let (size, limit) = (self.size(), expected + ENCODING_OVERHEAD);
        if is_raw && bytes != expected {
            return Err(HeaderError::Bytes { part, bytes, size, expected });
        }
        if !(1..=limit).contains(&bytes) {
            return Err(HeaderError::EncodedBytes { part, bytes, size, limit });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use plumb_config::error_chain::ErrorChain;

    use super::*;

    const GOOD: &str = r#"{"t": 12.345, "width": 640, "height": 480, "colour": "rgb8",
        "colour_bytes": 921600, "depth": "z16", "depth_bytes": 614400, "depth_scale": 1000.0}"#;

    fn refusal(from: &str, to: &str) -> String {
        let text = GOOD.replace(from, to);
        assert_ne!(text, GOOD, "{from}");
        ErrorChain(&Header::parse(&text).unwrap_err()).to_string()
    }

    #[test]
    fn the_documented_header_is_read() {
        let header = Header::parse(GOOD).unwrap();
        assert_eq!(header.size(), ImageSize { width: 640, height: 480 });
        assert_eq!((header.t, header.age, header.depth_scale), (12.345, 0.0, Some(1000.0)));
        let colour_only = r#"{"t": 0, "width": 4, "height": 3, "colour": "jpeg",
            "colour_bytes": 99, "age": 0.02}"#;
        let header = Header::parse(colour_only).unwrap();
        assert_eq!((header.colour, header.depth), (ColourEncoding::Jpeg, DepthEncoding::None));
        assert_eq!((header.depth_bytes, header.age), (0, 0.02));
    }

    #[test]
    fn values_out_of_range_are_refused_with_the_reason() {
        let cases = [
            ("12.345", "1700000000000000000", "not milliseconds or nanoseconds"),
            ("640", "0", "0x480 pixels: 1 to 8192"),
            ("640", "100000", "100000x480 pixels"),
            ("640", "-1", "invalid value"),
            ("640", "1e9", "invalid type"),
            ("921600", "4000000000", "a picture of 640x480 pixels has 921600 bytes"),
            ("614400", "614399", "`depth_bytes` is 614399"),
            ("z16", "none", "`depth` is \"none\", but `depth_bytes` is 614400"),
            ("1000.0", "0.001", "`depth_scale` is 0.001: depth units in a metre"),
            (", \"depth_scale\": 1000.0", "", "`depth_scale` is missing"),
            ("1000.0}", "1000.0, \"age\": -0.1}", "`age` is -0.1"),
            ("rgb8", "yuv", "unknown variant `yuv`"),
            ("\"t\"", "\"time\"", "unknown field `time`"),
            ("{", "", "not as documented"),
        ];
        for (from, to, reason) in cases {
            let message = refusal(from, to);
            assert!(message.contains(reason), "{to}: {message}");
        }
        let large = GOOD.replace("rgb8", "jpeg").replace("921600", "4000000000");
        let message = Header::parse(&large).unwrap_err().to_string();
        assert!(message.contains("1 to 987136 for a picture"), "{message}");
    }
}
