//! Pictures from messages.

use plumb_frame::image::{Bgr, ColourImage, DepthImage, Image as Pixels, ImageSize};
use plumb_pictures::bayer::{self, BayerOrder};
use plumb_pictures::decode::{self, DecodeError};
use plumb_pictures::raw::{self, InverseDepth};

use super::error::Ros2CameraError;
use crate::message::Header;
use crate::message::sensor::{CompressedImage, Image};

/// Units of depth in a metre: the encoding `16UC1` has millimetres (REP 118).
pub(crate) const DEPTH_SCALE: f64 = 1000.0;

/// Encodings of colour pictures.
const COLOURS: &str = "`rgb8`, `bgr8`, `rgba8`, `bgra8`, `yuv422`, `yuv422_yuy2` or `bayer_rggb8` \
                       (also `bggr8`, `gbrg8`, `grbg8`)";

/// Encodings of depth pictures.
const DEPTHS: &str = "`16UC1` (millimetres) or `32FC1` (metres)";

/// Formats of compressed depth pictures.
const DEPTH_FILES: &str = "`16UC1; compressedDepth` or `32FC1; compressedDepth` (png or rvl)";

/// Ends of the names of topics with `sensor_msgs/CompressedImage`.
const COMPRESSED: [&str; 2] = ["/compressed", "/compressedDepth"];

/// Bytes before a picture of `compressed_depth_image_transport`: a number, and the scale and the
/// offset of inverse depth, four bytes each.
const DEPTH_HEADER: usize = 12;

/// Most columns or rows of a picture.
pub(crate) const MAX_SIDE: u32 = 8192;

/// Picture as it comes.
#[derive(Debug)]
pub(crate) enum Picture {
    /// Of a topic of `sensor_msgs/Image`.
    Raw(Image),
    /// Of a topic of `sensor_msgs/CompressedImage`.
    Compressed(CompressedImage),
}

/// Returns whether a topic of this name has compressed pictures.
pub(crate) fn is_compressed(topic: &str) -> bool {
    COMPRESSED.iter().any(|end| topic.ends_with(end))
}

impl Picture {
    /// Returns the header of the message.
    pub(crate) fn header(&self) -> &Header {
        match self {
            Self::Raw(image) => &image.header,
            Self::Compressed(file) => &file.header,
        }
    }

    /// Decodes a colour picture, which came on `topic`.
    ///
    /// # Errors
    /// Where its encoding, its size or its bytes are wrong.
    pub(crate) fn colour(&self, topic: &str) -> Result<ColourImage, Ros2CameraError> {
        match self {
            Self::Raw(raw) => raw_colour(raw, topic),
            Self::Compressed(file) => compressed_colour(file, topic),
        }
    }

    /// Decodes a depth picture, which came on `topic`, to millimetres. 0 and 65535 are unknown
    /// depths, and so are metres that are no number, not above 0, or beyond 65.534.
    ///
    /// # Errors
    /// As [`Self::colour`].
    pub(crate) fn depth(&self, topic: &str) -> Result<DepthImage, Ros2CameraError> {
        match self {
            Self::Raw(raw) => raw_depth(raw, topic),
            Self::Compressed(file) => compressed_depth(file, topic),
        }
    }
}

/// Decodes a colour picture of bytes without a format.
fn raw_colour(raw: &Image, topic: &str) -> Result<ColourImage, Ros2CameraError> {
    let name = raw.encoding.to_ascii_lowercase();
    if let Some(order) = bayer_order(&name) {
        let pixels = bayer::bgr_of_bayer(&packed(raw, 1, topic)?, size(raw), order);
        return picture(pixels.ok_or_else(|| layout(raw, topic))?, size(raw));
    }
    let pixels = match name.as_str() {
        "rgb8" => raw::bgr_of_rgb(&packed(raw, 3, topic)?),
        "bgr8" => packed(raw, 3, topic)?.as_chunks().0.to_vec(),
        "rgba8" => raw::bgr_of_rgba(&packed(raw, 4, topic)?),
        "bgra8" => raw::bgr_of_bgra(&packed(raw, 4, topic)?),
        "yuv422" | "uyvy" => raw::bgr_of_uyvy(&packed(raw, 2, topic)?),
        "yuv422_yuy2" | "yuyv" => raw::bgr_of_yuyv(&packed(raw, 2, topic)?),
        "mono8" | "mono16" => return Err(grey(topic, &raw.encoding)),
        _ => return Err(encoding(&raw.encoding, topic, COLOURS)),
    };
    picture(pixels, size(raw))
}

/// Decodes a colour picture of `compressed_image_transport`. It stores the pixels of a Bayer filter
/// as a grey picture whose format is as `bayer_rggb8; jpeg compressed `.
fn compressed_colour(file: &CompressedImage, topic: &str) -> Result<ColourImage, Ros2CameraError> {
    let decoded = decode::colour(&file.data).map_err(damage(topic))?;
    if !decode::is_grey(&file.data) {
        return Ok(decoded);
    }
    let format = file.format.to_ascii_lowercase();
    let order = bayer_order(format.split(';').next().unwrap_or_default().trim());
    let bytes: Vec<u8> = decoded.pixels().iter().map(|&[value, ..]| value).collect();
    let pixels = order.and_then(|order| bayer::bgr_of_bayer(&bytes, decoded.size(), order));
    picture(pixels.ok_or_else(|| grey(topic, &file.format))?, decoded.size())
}

/// Returns the order of the Bayer filter in an encoding of 8 bits, in small letters.
fn bayer_order(encoding: &str) -> Option<BayerOrder> {
    match encoding {
        "bayer_rggb8" => Some(BayerOrder::Rggb),
        "bayer_bggr8" => Some(BayerOrder::Bggr),
        "bayer_gbrg8" => Some(BayerOrder::Gbrg),
        "bayer_grbg8" => Some(BayerOrder::Grbg),
        _ => None,
    }
}

fn picture(pixels: Vec<Bgr>, size: ImageSize) -> Result<ColourImage, Ros2CameraError> {
    Ok(Pixels::new(size.width, size.height, pixels)?)
}

/// Decodes a depth picture of bytes without a format.
fn raw_depth(raw: &Image, topic: &str) -> Result<DepthImage, Ros2CameraError> {
    let is_little = raw.is_bigendian == 0;
    let pixels = match raw.encoding.to_ascii_lowercase().as_str() {
        "16uc1" | "mono16" => raw::depth_of_numbers(&packed(raw, 2, topic)?, is_little),
        "32fc1" => raw::depth_of_metres(&packed(raw, 4, topic)?, is_little),
        _ => return Err(encoding(&raw.encoding, topic, DEPTHS)),
    };
    let ImageSize { width, height } = size(raw);
    Ok(Pixels::new(width, height, pixels)?)
}

/// Decodes a depth picture of `compressed_depth_image_transport`, whose format is as
/// `16UC1; compressedDepth png`, or a plain PNG of `compressed_image_transport`, as
/// `16UC1; png compressed`.
fn compressed_depth(file: &CompressedImage, topic: &str) -> Result<DepthImage, Ros2CameraError> {
    let format = file.format.to_ascii_lowercase();
    let (kind, rest) = format.split_once(';').unwrap_or((&format, ""));
    let mut words = rest.split_whitespace();
    let is_depth = words.next() == Some("compresseddepth");
    let refusal = || encoding(&file.format, topic, DEPTH_FILES);
    if !is_depth {
        // OpenCV's JPEG has no 16 bits.
        let is_png = kind.trim() == "png" || kind.trim() == "16uc1" || kind.trim() == "mono16";
        let depth = if is_png { decode::depth(&file.data) } else { return Err(refusal()) };
        return depth.map(raw::known_depth).map_err(damage(topic));
    }
    let (header, data) = file.data.split_at_checked(DEPTH_HEADER).unwrap_or_default();
    let decoded = match words.next() {
        None | Some("png") => decode::depth(data),
        Some("rvl") => decode::rvl_depth(data),
        Some(_) => return Err(refusal()),
    };
    let numbers = decoded.map_err(damage(topic))?;
    match kind.trim() {
        "16uc1" | "mono16" => Ok(raw::known_depth(numbers)),
        "32fc1" => Ok(inverse_depth(header, topic)?.millimetres(numbers)),
        _ => Err(refusal()),
    }
}

/// Reads the parameters of inverse depth from the `header` of a picture.
fn inverse_depth(header: &[u8], topic: &str) -> Result<InverseDepth, Ros2CameraError> {
    let number = |at: usize| {
        let bytes = header.get(at..).and_then(|rest| rest.first_chunk());
        bytes.map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes))
    };
    let [scale, offset] = [number(4), number(8)];
    if scale.is_finite() && offset.is_finite() && scale > 0.0 {
        return Ok(InverseDepth { scale, offset });
    }
    Err(Ros2CameraError::InverseDepth { topic: topic.to_owned(), scale, offset })
}

fn size(raw: &Image) -> ImageSize {
    ImageSize { width: raw.width as usize, height: raw.height as usize }
}

fn grey(topic: &str, found: &str) -> Ros2CameraError {
    Ros2CameraError::Grey { topic: topic.to_owned(), found: found.to_owned() }
}

fn encoding(found: &str, topic: &str, expected: &'static str) -> Ros2CameraError {
    Ros2CameraError::Encoding { topic: topic.to_owned(), found: found.to_owned(), expected }
}

fn layout(raw: &Image, topic: &str) -> Ros2CameraError {
    let (topic, bytes) = (topic.to_owned(), raw.data.len());
    Ros2CameraError::Layout { topic, size: size(raw), step: raw.step, bytes }
}

/// Returns the error of a picture of `topic` that cannot be decoded.
fn damage(topic: &str) -> impl Fn(DecodeError) -> Ros2CameraError {
    move |error| Ros2CameraError::Decode { topic: topic.to_owned(), error }
}

/// Returns the bytes of the pixels, `per_pixel` each, without the bytes that fill the rows.
fn packed(raw: &Image, per_pixel: usize, topic: &str) -> Result<Vec<u8>, Ros2CameraError> {
    let row = raw.width as usize * per_pixel;
    let (step, rows) = (raw.step as usize, raw.height as usize);
    let is_possible = raw.width.max(raw.height) <= MAX_SIDE && row > 0 && rows > 0;
    if !is_possible || step < row || raw.data.len() != step * rows {
        return Err(layout(raw, topic));
    }
    if step == row {
        return Ok(raw.data.clone());
    }
    Ok(raw.data.chunks_exact(step).flat_map(|bytes| &bytes[..row]).copied().collect())
}

#[cfg(test)]
mod tests {
    use plumb_config::error_chain::ErrorChain;
    use plumb_pictures::png;

    use super::*;
    use crate::message::Time;

    fn image(encoding: &str, step: u32, data: &[u8]) -> Image {
        let header = Header { stamp: Time::from_nanoseconds(0), frame_id: String::new() };
        let (encoding, data) = (encoding.to_owned(), data.to_vec());
        Image { header, height: 2, width: 1, encoding, is_bigendian: 0, step, data }
    }

    fn colour(encoding: &str, step: u32, data: &[u8]) -> Result<ColourImage, String> {
        let picture = Picture::Raw(image(encoding, step, data)).colour("/colour");
        picture.map_err(|error| error.to_string())
    }

    fn depth(image: Image) -> Result<DepthImage, String> {
        Picture::Raw(image).depth("/depth").map_err(|error| error.to_string())
    }

    #[test]
    fn both_orders_of_colours_and_filled_rows_are_read() {
        let expected = [[1, 2, 3], [4, 5, 6]];
        assert_eq!(colour("bgr8", 3, &[1, 2, 3, 4, 5, 6]).unwrap().pixels(), expected);
        assert_eq!(colour("rgb8", 3, &[3, 2, 1, 6, 5, 4]).unwrap().pixels(), expected);
        assert_eq!(colour("bgr8", 4, &[1, 2, 3, 0, 4, 5, 6, 0]).unwrap().pixels(), expected);
    }

    #[test]
    fn depth_is_read_in_either_byte_order() {
        let little = image("16UC1", 2, &[0x34, 0x12, 0, 0]);
        assert_eq!(depth(little).unwrap().pixels(), [0x1234, 0]);
        let big = Image { is_bigendian: 1, ..image("16UC1", 2, &[0x12, 0x34, 0, 0]) };
        assert_eq!(depth(big).unwrap().pixels(), [0x1234, 0]);
    }

    #[test]
    fn the_encodings_of_the_field_are_read() {
        let expected = [[1, 2, 3], [4, 5, 6]];
        assert_eq!(colour("bgra8", 4, &[1, 2, 3, 9, 4, 5, 6, 9]).unwrap().pixels(), expected);
        assert_eq!(colour("rgba8", 4, &[3, 2, 1, 9, 6, 5, 4, 9]).unwrap().pixels(), expected);
        let grey = colour("mono8", 1, &[1, 2]).unwrap_err();
        assert!(grey.contains("/colour") && grey.contains("grey (`mono8`)"), "{grey}");
        let metres = [1.2345_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(depth(image("32FC1", 4, &metres)).unwrap().pixels(), [1235, 0]);
        let unknown = image("16UC1", 2, &[0xff, 0xff, 0xfe, 0xff]);
        assert_eq!(depth(unknown).unwrap().pixels(), [0, 0xfffe]);
    }

    #[test]
    fn other_encodings_and_sizes_are_refused_with_the_topic() {
        for name in ["bayer_rggb16", "nv12", "8UC3", ""] {
            let error = colour(name, 2, &[0; 4]).unwrap_err();
            assert!(error.contains("/colour") && error.contains(&format!("`{name}`")), "{error}");
        }
        for (step, bytes) in [(3, 5), (3, 7), (2, 4), (u32::MAX, 6), (0, 0)] {
            let error = colour("rgb8", step, &vec![0; bytes]).unwrap_err();
            assert!(error.contains("/colour") && error.contains("bytes"), "{error}");
        }
        let huge = Image { height: u32::MAX, width: u32::MAX, ..image("rgb8", 0, &[]) };
        assert!(Picture::Raw(huge).colour("/colour").is_err());
        let bytes = depth(image("8UC1", 1, &[0; 2])).unwrap_err();
        assert!(bytes.contains("`8UC1`") && bytes.contains("16UC1"), "{bytes}");
    }

    #[test]
    fn pictures_without_pixels_are_refused_and_capitals_are_read() {
        for (height, width) in [(0, 1), (1, 0), (0, 0)] {
            let empty = Image { height, width, ..image("rgb8", 3, &[]) };
            let error = Picture::Raw(empty).colour("/colour").unwrap_err().to_string();
            assert!(error.contains(&format!("a picture of {width}x{height}")), "{error}");
        }
        assert_eq!(colour("RGB8", 3, &[3, 2, 1, 6, 5, 4]).unwrap().pixels()[0], [1, 2, 3]);
        assert_eq!(depth(image("16uc1", 2, &[1, 0, 2, 0])).unwrap().pixels(), [1, 2]);
    }

    #[test]
    fn each_order_of_a_bayer_filter_is_read() {
        // Red 200, green 100, blue 50.
        for (name, rows) in [
            ("bayer_rggb8", [200, 100, 100, 50]),
            ("bayer_bggr8", [50, 100, 100, 200]),
            ("bayer_gbrg8", [100, 50, 200, 100]),
            ("bayer_grbg8", [100, 200, 50, 100]),
        ] {
            let picture = Image { width: 2, ..image(name, 2, &rows) };
            let picture = Picture::Raw(picture).colour("/colour").unwrap();
            assert_eq!(picture.pixels(), [[50, 100, 200]; 4], "{name}");
            let error = colour(name, 1, &[0; 2]).unwrap_err();
            assert!(error.contains("a picture of 1x2"), "{error}");
        }
    }

    #[test]
    fn a_grey_file_is_refused_unless_it_has_the_pixels_of_a_bayer_filter() {
        let of = |format: &str, data: &[u8]| {
            let (format, data) = (format.to_owned(), data.to_vec());
            let header = image("", 0, &[]).header;
            let file = CompressedImage { header, format, data };
            Picture::Compressed(file).colour("/colour").map_err(|error| error.to_string())
        };
        let mosaic = b"P5 2 2 255 \x64\x32\xc8\x64";
        let picture = of("bayer_gbrg8; png compressed ", mosaic).unwrap();
        assert_eq!(picture.pixels(), [[50, 100, 200]; 4]);
        for format in ["mono8; jpeg compressed ", "jpeg", "bayer_rggb16; png compressed "] {
            let error = of(format, mosaic).unwrap_err();
            assert!(error.contains(&format!("/colour: the pictures are grey (`{format}`)")));
        }
        let colour = b"P6 1 1 255 \x03\x02\x01";
        assert_eq!(of("bayer_rggb8; jpeg compressed bgr8", colour).unwrap().pixels(), [[1, 2, 3]]);
    }

    /// Returns the depth of two pixels in a file of this format.
    fn compressed(format: &str, header: &[u8], data: &[u8]) -> Result<Vec<u16>, String> {
        let (format, data) = (format.to_owned(), [header, data].concat());
        let header = image("", 0, &[]).header;
        let file = Picture::Compressed(CompressedImage { header, format, data });
        let text = |error: Ros2CameraError| ErrorChain(&error).to_string();
        file.depth("/depth").map(|depth| depth.pixels().to_vec()).map_err(text)
    }

    /// Bytes before a picture with this scale and offset of inverse depth.
    fn depth_header(scale: f32, offset: f32) -> Vec<u8> {
        [[0; 4], scale.to_le_bytes(), offset.to_le_bytes()].concat()
    }

    fn png(depth: [u16; 2]) -> Vec<u8> {
        png::encode_depth(&Pixels::new(1, 2, depth.to_vec()).unwrap()).unwrap()
    }

    /// A picture of one column and the depth 5 and 4 in RVL.
    const RVL: [u8; 12] = [1, 0, 0, 0, 2, 0, 0, 0, 0, 0x10, 0xa1, 0x02];

    #[test]
    fn compressed_depth_is_read() {
        let zeros = [0; DEPTH_HEADER];
        for format in
            ["16UC1; compressedDepth", "16UC1; compressedDepth png", "mono16; compressedDepth png"]
        {
            assert_eq!(compressed(format, &zeros, &png([1500, 65_535])), Ok(vec![1500, 0]));
        }
        for format in ["16UC1; png compressed ", "png", "16UC1"] {
            assert_eq!(compressed(format, &[], &png([1500, 65_535])), Ok(vec![1500, 0]));
        }
        let rvl = "16UC1; compressedDepth rvl";
        assert_eq!(compressed(rvl, &zeros, &RVL), Ok(vec![5, 4]));
        let inverse = depth_header(3.0, 2.0);
        let metres = "32FC1; compressedDepth png";
        assert_eq!(compressed(metres, &inverse, &png([5, 0])), Ok(vec![1000, 0]));
        let metres = "32FC1; compressedDepth rvl";
        assert_eq!(compressed(metres, &inverse, &RVL), Ok(vec![1000, 1500]));
    }

    #[test]
    fn compressed_depth_that_cannot_be_read_is_refused_by_name() {
        let zeros = [0; DEPTH_HEADER];
        for format in
            ["16UC1; compressedDepth zstd", "rgb8; jpeg compressed bgr8", "; compressedDepth", ""]
        {
            let error = compressed(format, &zeros, &png([1, 2])).unwrap_err();
            assert!(error.contains("/depth") && error.contains(&format!("`{format}`")), "{error}");
        }
        for (scale, offset) in [(0.0, 0.0), (-1.0, 0.0), (f32::NAN, 0.0), (1.0, f32::INFINITY)] {
            let header = depth_header(scale, offset);
            let error = compressed("32FC1; compressedDepth", &header, &png([1, 2])).unwrap_err();
            assert!(error.contains("/depth") && error.contains(&scale.to_string()), "{error}");
        }
        for (format, data) in [
            ("16UC1; compressedDepth png", &RVL[..]),
            ("16UC1; compressedDepth rvl", &png([1, 2])),
            ("16UC1; compressedDepth", &[]),
        ] {
            let error = compressed(format, &zeros[..data.len().min(12)], data).unwrap_err();
            assert!(error.contains("/depth: a picture cannot be decoded"), "{error}");
        }
    }
}
