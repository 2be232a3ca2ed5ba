//! First guess of a lens without distortion, and of the poses of the board.

use nalgebra::{Isometry3, Matrix3, Point2};
use plumb_frame::image::ImageSize;

use super::bundle::{ALL, Bundle, Corners};
use crate::homography;

/// Focal length where the views do not determine one, in widths of the picture: 53 degrees of view.
const USUAL_FOCAL: f64 = 1.0;

/// Returns the guess: the principal point in the middle, the focal length of the homographies from
/// the board to the pictures (Zhang, "A flexible new technique for camera calibration", with square
/// pixels), no distortion. Returns `None` if a view's corners lie on a line.
pub(super) fn guess(views: &[&Corners], size: ImageSize) -> Option<Bundle> {
    let middle = [size.width, size.height].map(|pixels| (pixels as f64 - 1.0) / 2.0);
    let maps: Vec<Matrix3<f64>> =
        views.iter().map(|corners| centred_map(corners, middle)).collect::<Option<_>>()?;
    let focal = focal(&maps).unwrap_or(USUAL_FOCAL * size.width as f64);
    let to_rays = Matrix3::from_diagonal(&[1.0 / focal, 1.0 / focal, 1.0].into());
    let poses: Vec<Isometry3<f64>> =
        maps.iter().map(|map| homography::pose(&(to_rays * map))).collect();
    let mut lens = [0.0; ALL];
    lens[..4].copy_from_slice(&[focal, focal, middle[0], middle[1]]);
    Some(Bundle { lens, poses })
}

/// Returns the homography from the board to the picture with its origin in the middle.
fn centred_map(corners: &Corners, [cx, cy]: [f64; 2]) -> Option<Matrix3<f64>> {
    let pair = |it: &super::SeenCorner| (it.board, Point2::new(it.image.x - cx, it.image.y - cy));
    homography::fit(&corners.iter().map(pair).collect::<Vec<_>>())
}

/// Returns the focal length with which the board's axes are perpendicular and of one length in all
/// views, pixels; `None` if none is.
fn focal(maps: &[Matrix3<f64>]) -> Option<f64> {
    // Both conditions are linear in w = 1 / f²: a w + b = 0.
    let (mut ab, mut aa) = (0.0, 0.0);
    for map in maps {
        let map = map / map.column(0).norm().max(map.column(1).norm());
        let (x, y) = (map.column(0), map.column(1));
        let across = [x.xy().dot(&y.xy()), x.xy().norm_squared() - y.xy().norm_squared()];
        let along = [x.z * y.z, x.z * x.z - y.z * y.z];
        for (a, b) in across.into_iter().zip(along) {
            ab += a * b;
            aa += a * a;
        }
    }
    let w = -ab / aa;
    (w.is_finite() && w > 0.0).then(|| (1.0 / w).sqrt())
}
