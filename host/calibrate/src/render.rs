//! A renderer of the board, for tests, benchmarks and the simulated camera.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::{ColourImage, DepthImage, ImageSize};

use crate::board::CharucoSheet;

/// White margin of the sheet around the chessboard, metres.
const MARGIN_M: f64 = 0.012;
/// Grey levels of paper and ink.
const PAPER: f64 = 215.0;
const INK: f64 = 35.0;
/// Rays through a pixel along each of its sides.
const RAYS: usize = 4;

/// Draws the board in front of what the images show. `pose` transforms board axes into camera axes.
/// The depth image has `intrinsics.depth_scale` units a metre.
pub fn draw_board(
    (colour, depth): (&mut ColourImage, &mut DepthImage),
    intrinsics: &Intrinsics,
    board: &CharucoSheet,
    pose: &Isometry3<f64>,
) {
    let width = colour.width();
    let pixels = colour.pixels_mut().iter_mut().zip(depth.pixels_mut()).enumerate();
    for (i, (pixel, raw)) in pixels {
        let (u, v) = ((i % width) as f64, (i / width) as f64);
        let Some(z) = sheet_point(intrinsics, board, pose, u, v).map(|(_, z)| z) else {
            continue;
        };
        let near = (z * intrinsics.depth_scale).round();
        if near > f64::from(u16::MAX) || (*raw != 0 && f64::from(*raw) <= near) {
            continue;
        }
        *raw = near as u16;
        *pixel = [shade(intrinsics, board, pose, u, v) as u8; 3];
    }
}

/// Returns the mean grey level of the sheet over a pixel.
fn shade(
    intrinsics: &Intrinsics,
    board: &CharucoSheet,
    pose: &Isometry3<f64>,
    u: f64,
    v: f64,
) -> f64 {
    let offset = |k: usize| (k as f64 + 0.5) / RAYS as f64 - 0.5;
    let rays = (0..RAYS * RAYS).map(|k| (u + offset(k % RAYS), v + offset(k / RAYS)));
    let greys = rays.map(|(u, v)| match sheet_point(intrinsics, board, pose, u, v) {
        Some((p, _)) if board.is_black(p.x, p.y) == Some(true) => INK,
        _ => PAPER,
    });
    greys.sum::<f64>() / (RAYS * RAYS) as f64
}

/// Returns the point of the sheet at a pixel (board axes) and its depth, metres; `None` where the
/// sheet is not seen from its printed side.
fn sheet_point(
    intrinsics: &Intrinsics,
    board: &CharucoSheet,
    pose: &Isometry3<f64>,
    u: f64,
    v: f64,
) -> Option<(Point3<f64>, f64)> {
    let eye = pose.inverse_transform_point(&Point3::origin());
    let ray = pose.inverse_transform_vector(&intrinsics.deproject(u, v, 1.0).coords);
    // The ray has depth 1, so that the factor is the depth.
    let z = -eye.z / ray.z;
    let p = eye + ray * z;
    let [w, h] = board.size();
    let is_on_sheet =
        (-MARGIN_M..=w + MARGIN_M).contains(&p.x) && (-MARGIN_M..=h + MARGIN_M).contains(&p.y);
    (eye.z > 0.0 && z > 0.0 && is_on_sheet).then_some((p, z))
}

/// Returns a pose of the board, from board axes into camera axes, as a person would show it to a
/// camera with `intrinsics` and pictures of `size` to calibrate its lens. The poses of the numbers
/// from 0 on are spread over the picture, near and far, tilted to all sides.
pub fn shown_pose(
    intrinsics: &Intrinsics,
    size: ImageSize,
    board: &CharucoSheet,
    number: u32,
) -> Isometry3<f64> {
    let spread = |base: u32, low: f64, high: f64| low + (high - low) * halton(number + 1, base);
    let [u, v] = [(2, size.width), (3, size.height)]
        .map(|(base, pixels)| spread(base, 0.15, 0.85) * pixels as f64);
    let [w, h] = board.size();
    let depth = intrinsics.fx * w / (spread(5, 0.35, 0.7) * size.width as f64);
    let tilt = [spread(7, -0.7, 0.7), spread(11, -0.7, 0.7), spread(13, -0.4, 0.4)];
    // The board's y axis points up, that of the camera down.
    let face_on = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(tilt)) * face_on;
    let middle = intrinsics.deproject(u, v, depth).coords;
    let origin = middle - rotation * Vector3::new(w / 2.0, h / 2.0, 0.0);
    Isometry3::from_parts(Translation3::from(origin), rotation)
}

/// Returns element `index` of Halton's sequence: evenly spread numbers in 0 to 1.
fn halton(mut index: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / f64::from(base));
    while index > 0 {
        value += digit * f64::from(index % base);
        digit /= f64::from(base);
        index /= base;
    }
    value
}
