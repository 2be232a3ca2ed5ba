//! Images as OpenCV's matrices: the pixels are borrowed, not copied.

use opencv::boxed_ref::BoxedRef;
use opencv::core::{Mat, Vec3b};

use crate::image::ColourImage;

/// Borrows a colour image as a matrix of type `CV_8UC3`.
pub(crate) fn borrow_colour(image: &ColourImage) -> opencv::Result<BoxedRef<'_, Mat>> {
    let [rows, columns] = [image.height(), image.width()].map(i32::try_from);
    Mat::new_rows_cols_with_bytes::<Vec3b>(rows?, columns?, image.channels())
}
