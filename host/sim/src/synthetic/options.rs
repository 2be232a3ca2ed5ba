//! Options of a synthetic camera.

use super::light::Light;
use super::sensor::SensorOptions;

/// Options of rendering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// Columns of the frame of a [`Background::Room`](super::Background::Room); a recorded one has
    /// its own size.
    pub width: u16,
    /// Rows of the frame of a [`Background::Room`](super::Background::Room).
    pub height: u16,
    /// Light on the ball and the cables (a room is lit by its own lamp and window).
    pub light: Light,
    /// Noise model of the sensors.
    pub sensor: SensorOptions,
}

impl Default for RenderOptions {
    /// 640x480, the light and the sensor of their defaults.
    fn default() -> Self {
        Self { width: 640, height: 480, light: Light::default(), sensor: SensorOptions::default() }
    }
}
