//! Depth of a surface at a pixel.

use nalgebra::Point2;
use plumb_frame::frame::RgbdFrame;

/// Standard deviation of a depth camera at 1 m, metres. It grows with the square of the depth. The
/// value is the part that neighbouring pixels share (Khoshelham and Elberink 2012: 1.4 mm at 1 m
/// for a Kinect).
const DEPTH_SD_M: f64 = 0.001_5;

/// Returns the standard deviation of the depth `z`, metres.
pub(crate) fn depth_sd(z: f64) -> f64 {
    DEPTH_SD_M * z * z
}

/// Returns the median depth, metres, of the square of `radius` pixels around a pixel; `None` if
/// less than a quarter of it has depth.
pub(crate) fn depth_near(frame: &RgbdFrame, pixel: &Point2<f64>, radius: i32) -> Option<f64> {
    let (u, v) = (pixel.x.round() as i32, pixel.y.round() as i32);
    let places = (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| (x, y)));
    let mut depths: Vec<f64> =
        places.filter_map(|(x, y)| frame.depth_at(u.checked_add(x)?, v.checked_add(y)?)).collect();
    depths.sort_by(f64::total_cmp);
    let side = 2 * radius as usize + 1;
    (4 * depths.len() >= side * side).then(|| depths[depths.len() / 2])
}
