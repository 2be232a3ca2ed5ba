//! Defocus of a frame; defocus and motion blur of a layer.

use std::borrow::Cow;

use opencv::core::{CV_32F, Mat, MatTrait, MatTraitConstManual, Point, Scalar, Size, Vec3f, Vec4f};
use opencv::imgproc::{filter_2d_def, gaussian_blur_def};

use super::appearance::Appearance;

/// Returns a layer of `columns` x `rows` pixels with defocus and motion blur.
pub(super) fn blurred(
    layer: &[Vec4f],
    (columns, rows): (i32, i32),
    appearance: &Appearance,
) -> opencv::Result<Vec<Vec4f>> {
    let sharp = Mat::new_rows_cols_with_data(rows, columns, layer)?;
    let mut soft = Mat::default();
    gaussian_blur_def(&sharp, &mut soft, Size::default(), appearance.blur.max(0.05))?;
    let length = appearance.motion.0.hypot(appearance.motion.1);
    if length > 0.5 {
        let reach = (length / 2.0).ceil() as i32 + 1;
        let size = 2 * reach + 1;
        let mut kernel = Mat::new_rows_cols_with_default(size, size, CV_32F, Scalar::all(0.0))?;
        let steps = 8 * reach;
        for k in 0..=steps {
            let way = f64::from(k) / f64::from(steps) - 0.5;
            add_weight(
                &mut kernel,
                reach,
                (way * appearance.motion.0, way * appearance.motion.1),
                1.0 / (f64::from(steps) + 1.0),
            )?;
        }
        let sharp = soft;
        soft = Mat::default();
        filter_2d_def(&sharp, &mut soft, -1, &kernel)?;
    }
    Ok(soft.data_typed::<Vec4f>()?.to_vec())
}

/// Returns a frame of `columns` x `rows` linear colours blurred by `sigma` pixels, or unchanged if
/// that is 0.
pub(super) fn defocused(
    colour: &[[f32; 3]],
    (columns, rows): (i32, i32),
    sigma: f64,
) -> opencv::Result<Cow<'_, [[f32; 3]]>> {
    if sigma <= 0.0 {
        return Ok(Cow::Borrowed(colour));
    }
    let colour: Vec<Vec3f> = colour.iter().map(|&pixel| Vec3f::from(pixel)).collect();
    let sharp = Mat::new_rows_cols_with_data(rows, columns, &colour)?;
    let mut soft = Mat::default();
    gaussian_blur_def(&sharp, &mut soft, Size::default(), sigma)?;
    Ok(Cow::Owned(soft.data_typed::<Vec3f>()?.iter().map(|pixel| pixel.0).collect()))
}

/// Adds `weight` to a kernel at an offset from its middle, shared among the four nearest cells.
fn add_weight(kernel: &mut Mat, reach: i32, (x, y): (f64, f64), weight: f64) -> opencv::Result<()> {
    let (left, top) = (x.floor(), y.floor());
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = |whole: f64, x: f64, d: i32| if d == 0 { 1.0 - (x - whole) } else { x - whole };
        let part = weight * share(left, x, dx) * share(top, y, dy);
        let at = Point::new(reach + left as i32 + dx, reach + top as i32 + dy);
        if part > 0.0 {
            *kernel.at_pt_mut::<f32>(at)? += part as f32;
        }
    }
    Ok(())
}
