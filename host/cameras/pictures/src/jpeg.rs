//! JPEG images, for viewers.

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, SamplingFactor};
use plumb_frame::image::ColourImage;

use crate::BoxedError;

/// Encodes a colour image; `quality` is 1 (smallest) to 100 (best). Colour has half the resolution
/// of brightness along both axes (4:2:0).
///
/// # Errors
/// Where the image has no pixels, or more than 65535 columns or rows.
pub fn encode(image: &ColourImage, quality: u8) -> Result<Vec<u8>, BoxedError> {
    let (width, height) = (image.width().try_into()?, image.height().try_into()?);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, quality.clamp(1, 100));
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    encoder.encode(image.channels(), width, height, ColorType::Bgr)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode;
    use plumb_frame::image::Image;

    #[test]
    fn a_better_quality_takes_more_bytes() {
        let image = Image::from_fn(64, 48, |column, row| {
            [column as u8 * 4, row as u8 * 5, (column * row) as u8]
        });
        let [small, large] = [30, 95].map(|quality| encode(&image, quality).unwrap());
        assert_eq!([&small[..3], &large[..3]], [b"\xff\xd8\xff"; 2]);
        assert!(small.len() < large.len(), "{} {}", small.len(), large.len());
    }

    #[test]
    fn a_smooth_picture_is_decoded_as_it_was() {
        for (width, height) in [(64, 48), (61, 47), (1, 1)] {
            let image = Image::from_fn(width, height, |column, row| {
                [200 - 2 * column as u8, 3 * row as u8, (column + row) as u8]
            });
            let decoded = decode::colour(&encode(&image, 95).unwrap()).unwrap();
            assert_eq!(decoded.size(), image.size());
            let pairs = decoded.channels().iter().zip(image.channels());
            let worst = pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            assert!(worst <= 8, "{width}x{height}: {worst}");
        }
    }

    #[test]
    fn an_image_without_pixels_or_with_too_many_columns_is_refused() {
        for (width, height) in [(0, 0), (0, 5), (65_536, 1)] {
            assert!(encode(&Image::filled(width, height, [0; 3]), 80).is_err());
        }
    }
}
