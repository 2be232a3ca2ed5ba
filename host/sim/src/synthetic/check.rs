//! Checks of the parameters of a synthetic camera.

use plumb_frame::camera::{Camera, Intrinsics};

use super::error::SyntheticError;
use super::options::RenderOptions;
use super::sensor::SensorOptions;

/// Returns an error for `what` unless `holds`.
pub(super) fn require(
    what: &'static str,
    value: f64,
    holds: bool,
    must: &'static str,
) -> Result<(), SyntheticError> {
    if holds { Ok(()) } else { Err(SyntheticError::Value { what, value, must }) }
}

/// Checks the parameters of a synthetic camera with frames of `size` (columns, rows).
pub(super) fn check(
    camera: &Camera,
    options: &RenderOptions,
    size: (usize, usize),
) -> Result<(), SyntheticError> {
    check_size(size)?;
    check_camera(camera)?;
    check_sensor(&options.sensor)?;
    check_principal_point(&camera.intrinsics, size)?;
    Ok(camera.intrinsics.check_distortion(size.0, size.1)?)
}

/// Checks the columns and rows of the frames.
fn check_size((width, height): (usize, usize)) -> Result<(), SyntheticError> {
    let must = "16 to 8192 pixels";
    require("the frame's width", width as f64, (16..=8192).contains(&width), must)?;
    require("the frame's height", height as f64, (16..=8192).contains(&height), must)
}

/// Checks the focal lengths, the depth scale and the ball.
fn check_camera(camera: &Camera) -> Result<(), SyntheticError> {
    let (lens, diameter) = (&camera.intrinsics, camera.ball_diameter);
    let positive = |x: f64| x > 0.0 && x.is_finite();
    require("fx", lens.fx, positive(lens.fx), "more than 0 pixels")?;
    require("fy", lens.fy, positive(lens.fy), "more than 0 pixels")?;
    let scale = lens.depth_scale;
    require("depth_scale", scale, scale >= 0.0 && scale.is_finite(), "at least 0")?;
    require("the ball's diameter", diameter, positive(diameter), "more than 0 m")
}

/// Checks the noise, the steps and the range of the sensor.
fn check_sensor(sensor: &SensorOptions) -> Result<(), SyntheticError> {
    let SensorOptions { colour_noise, depth_noise, depth_step, speckle, nearest, farthest, .. } =
        *sensor;
    let within = |x: f64, low: f64, high: f64| (low..=high).contains(&x);
    require("colour_noise", colour_noise, within(colour_noise, 0.0, 100.0), "0 to 100")?;
    require("depth_noise", depth_noise, within(depth_noise, 0.0, 1.0), "0 to 1 m")?;
    require("depth_step", depth_step, within(depth_step, 0.000_5, 0.1), "0.0005 to 0.1 m")?;
    require("speckle", speckle, within(speckle, 0.0, 0.5), "0 to 0.5")?;
    require("nearest", nearest, within(nearest, 0.1, 100.0), "0.1 to 100 m")?;
    require("farthest", farthest, within(farthest, nearest, 1e3), "beyond the nearest")
}

/// Checks that the principal point lies inside the frame.
fn check_principal_point(
    lens: &Intrinsics,
    (width, height): (usize, usize),
) -> Result<(), SyntheticError> {
    if (0.0..width as f64).contains(&lens.cx) && (0.0..height as f64).contains(&lens.cy) {
        Ok(())
    } else {
        Err(SyntheticError::Intrinsics { cx: lens.cx, cy: lens.cy, width, height })
    }
}
