//! JPEG images, for viewers.

use opencv::core::{Mat, Vec3b, Vector};
use opencv::imgcodecs::{IMWRITE_JPEG_QUALITY, imencode};
use plumb_frame::image::ColourImage;

use crate::source::BoxedError;

/// Encodes a colour image; `quality` is 1 (smallest) to 100 (best).
///
/// # Errors
/// Where OpenCV cannot encode the image.
pub fn encode(image: &ColourImage, quality: u8) -> Result<Vec<u8>, BoxedError> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    let matrix = Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, image.channels())?;
    let mut bytes = Vector::<u8>::new();
    let options = Vector::from_slice(&[IMWRITE_JPEG_QUALITY, i32::from(quality)]);
    imencode(".jpg", &matrix, &mut bytes, &options)?;
    Ok(bytes.into())
}

#[cfg(test)]
mod tests {
    use super::*;
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
}
