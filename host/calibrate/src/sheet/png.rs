//! The sheet as a PNG file that states its resolution.

use crc::{CRC_32_ISO_HDLC, Crc};
use opencv::core::{Mat, Point, Scalar, Vec3b};
use opencv::imgproc::{FONT_HERSHEY_SIMPLEX, LINE_AA, put_text};
use plumb_frame::image::{ColourImage, Image};
use plumb_pictures::png::encode_colour;

use super::Mark;
use crate::corners::ProcessingError;

/// Pixels in a millimetre: 300 dots per inch.
const PIXELS: f64 = 300.0 / 25.4;
/// Pixels in a metre, rounded as the file states them.
const PIXELS_IN_METRE: u32 = 11_811;
/// Height of the font's capital letters at scale 1, pixels.
const LETTER_PIXELS: f64 = 22.0;
/// Length of the PNG signature and the chunk IHDR, bytes: the resolution follows them.
const HEAD_BYTES: usize = 8 + 25;

/// Returns the sheet of the size `size_mm` (millimetres) as a PNG file.
pub(super) fn file(size_mm: [f64; 2], marks: &[Mark]) -> Result<Vec<u8>, ProcessingError> {
    let image = draw(size_mm, marks)?;
    let mut bytes = encode_colour(&image).map_err(ProcessingError::new)?;
    bytes.splice(HEAD_BYTES..HEAD_BYTES, resolution());
    Ok(bytes)
}

/// Returns the chunk pHYs: pixels in a metre along both axes.
fn resolution() -> Vec<u8> {
    let mut chunk = 9_u32.to_be_bytes().to_vec();
    chunk.extend(b"pHYs");
    chunk.extend(PIXELS_IN_METRE.to_be_bytes());
    chunk.extend(PIXELS_IN_METRE.to_be_bytes());
    chunk.push(1);
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&chunk[4..]);
    chunk.extend(checksum.to_be_bytes());
    chunk
}

/// Draws the marks in black on white.
fn draw([width, height]: [f64; 2], marks: &[Mark]) -> opencv::Result<ColourImage> {
    let [columns, rows] = [width, height].map(|mm| (mm * PIXELS).round() as usize);
    let mut image: ColourImage = Image::filled(columns, rows, [255; 3]);
    for mark in marks {
        if let Mark::Rectangle { corner: [x, y], size: [w, h] } = mark {
            let pixel = |mm: f64, most: usize| ((mm * PIXELS).round() as usize).min(most);
            let (left, right) = (pixel(*x, columns), pixel(x + w, columns));
            let (top, bottom) = (pixel(height - y - h, rows), pixel(height - y, rows));
            for row in top..bottom {
                image.pixels_mut()[row * columns + left..row * columns + right].fill([0; 3]);
            }
        }
    }
    let (rows, columns) = (rows as i32, columns as i32);
    let mut mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, columns, image.channels_mut())?;
    for mark in marks {
        if let Mark::Text { corner: [x, y], height: letter, text } = mark {
            let at = Point::new((x * PIXELS) as i32, ((height - y) * PIXELS) as i32);
            let scale = letter * PIXELS / LETTER_PIXELS;
            let (font, black) = (FONT_HERSHEY_SIMPLEX, Scalar::all(0.0));
            put_text(&mut mat, text, at, font, scale, black, 2, LINE_AA, false)?;
        }
    }
    drop(mat);
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::super::{Paper, png};
    use crate::board::CharucoSheet;
    use crate::corners::find_corners;
    use plumb_frame::image::Image;

    #[test]
    fn the_board_is_found_in_the_file_at_its_true_scale() {
        let bytes = png(Paper::A4).unwrap();
        assert_eq!(&bytes[33 + 4..33 + 8], b"pHYs");
        let sheet = super::draw(Paper::A4.size_mm(), &super::super::marks(Paper::A4)).unwrap();
        // A sixth of the size: 50 dots per inch.
        let (width, height) = (sheet.width() / 6, sheet.height() / 6);
        let small = Image::from_fn(width, height, |u, v| {
            let block = (0..36).map(|k| sheet.get(6 * u + k % 6, 6 * v + k / 6).unwrap()[0]);
            [(block.map(u32::from).sum::<u32>() / 36) as u8; 3]
        });
        let corners = find_corners(&small, &CharucoSheet::SHEET).unwrap();
        assert_eq!(corners.len(), 24);
        let side = (corners[5].image - corners[0].image).norm() / 5.0;
        let expected = 36.0 / 25.4 * 300.0 / 6.0;
        assert!((side - expected).abs() < 0.05, "{side} {expected}");
    }
}
