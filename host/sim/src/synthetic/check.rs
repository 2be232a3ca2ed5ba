//! Checks of the parameters of a synthetic camera.

use plumb_vision::camera::Camera;

use super::{RenderOptions, SyntheticError};

/// Returns an error for `what` unless `holds`.
pub(super) fn require(
    what: &'static str,
    value: f64,
    holds: bool,
    must: &'static str,
) -> Result<(), SyntheticError> {
    if holds { Ok(()) } else { Err(SyntheticError::Value { what, value, must }) }
}

/// Checks the parameters of a synthetic camera.
pub(super) fn check(
    camera: &Camera,
    options: &RenderOptions,
    (width, height): (usize, usize),
) -> Result<(), SyntheticError> {
    let (lens, sensor) = (&camera.intrinsics, &options.sensor);
    let positive = |x: f64| x > 0.0 && x.is_finite();
    require(
        "the picture's width",
        width as f64,
        (16..=8192).contains(&width),
        "16 to 8192 pixels",
    )?;
    require(
        "the picture's height",
        height as f64,
        (16..=8192).contains(&height),
        "16 to 8192 pixels",
    )?;
    require("fx", lens.fx, positive(lens.fx), "more than 0 pixels")?;
    require("fy", lens.fy, positive(lens.fy), "more than 0 pixels")?;
    require("depth_scale", lens.depth_scale, positive(lens.depth_scale), "more than 0")?;
    require(
        "the ball's diameter",
        camera.ball_diameter,
        positive(camera.ball_diameter),
        "more than 0 m",
    )?;
    let known = |x: f64, low: f64, high: f64| (low..=high).contains(&x);
    require(
        "colour_noise",
        sensor.colour_noise,
        known(sensor.colour_noise, 0.0, 100.0),
        "0 to 100",
    )?;
    require("depth_noise", sensor.depth_noise, known(sensor.depth_noise, 0.0, 1.0), "0 to 1 m")?;
    require(
        "depth_step",
        sensor.depth_step,
        known(sensor.depth_step, 0.000_5, 0.1),
        "0.0005 to 0.1 m",
    )?;
    require("speckle", sensor.speckle, known(sensor.speckle, 0.0, 0.5), "0 to 0.5")?;
    require("nearest", sensor.nearest, known(sensor.nearest, 0.1, 100.0), "0.1 to 100 m")?;
    require(
        "farthest",
        sensor.farthest,
        known(sensor.farthest, sensor.nearest, 1e3),
        "beyond the nearest",
    )?;
    let inside = (0.0..width as f64).contains(&lens.cx) && (0.0..height as f64).contains(&lens.cy);
    if inside {
        Ok(())
    } else {
        Err(SyntheticError::Intrinsics { cx: lens.cx, cy: lens.cy, width, height })
    }
}
