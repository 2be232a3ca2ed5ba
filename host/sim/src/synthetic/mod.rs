//! A camera that is not there: it renders the rig's ball, its cables and what a depth sensor makes
//! of them into a recorded picture or a furnished room.
//!
//! The same seed and the same calls give the same pictures, bit for bit.

mod arrange;
mod ball;
mod canvas;
mod light;
pub mod overlay;
mod room;
mod scene;
mod sensor;
mod strand;

pub use light::{Light, Material};
pub use room::{Pattern, Room, Shape, Thing};
pub use scene::{Ball, Scene, Strand};
pub use sensor::SensorOptions;

use nalgebra::Isometry3;
use plumb_vision::camera::Camera;
use plumb_vision::frame::{FrameError, RgbdFrame};
use plumb_vision::image::{ColourImage, Image, ImageError};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use arrange::{What, items};
use ball::Style;
use canvas::Canvas;
use light::{CameraLight, decode, encode};
use sensor::{Disparity, Sensor};

/// What is behind the ball.
#[derive(Debug, Clone)]
pub enum Background {
    /// A recorded picture, used as wallpaper: everything is drawn in front of it. Its own
    /// intrinsics only say what its depth means; the camera's say where things are seen.
    Frame(RgbdFrame),
    /// A room, cast once from where the camera stands. Its things hide what is behind them.
    Room(Room),
}

/// How the pictures are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Columns of the picture of a [`Background::Room`]; a recorded one has its own size.
    pub width: u16,
    /// Rows of the picture of a [`Background::Room`].
    pub height: u16,
    /// Light on the ball and the cables (a room is lit by its own lamp and window).
    pub light: Light,
    /// What the sensors add.
    pub sensor: SensorOptions,
}

impl Default for Options {
    /// 640x480, the light and the sensor of their defaults.
    fn default() -> Self {
        Self { width: 640, height: 480, light: Light::default(), sensor: SensorOptions::default() }
    }
}

/// Why there is no synthetic camera, or no picture of it.
#[derive(Debug, Error)]
pub enum SyntheticError {
    /// A number that cannot be.
    #[error("synthetic camera: {what} is {value}, but must be {must}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        must: &'static str,
    },
    /// The intrinsics are those of a picture of another size.
    #[error(
        "synthetic camera: its principal point ({cx}, {cy}) is not in a picture of {width}x{height}; give the background's own intrinsics"
    )]
    Intrinsics {
        /// Principal point, pixels.
        cx: f64,
        /// Principal point, pixels.
        cy: f64,
        /// Columns of the background.
        width: usize,
        /// Rows of the background.
        height: usize,
    },
    /// What was rendered is not a frame (the time stamp).
    #[error("synthetic camera: {0}")]
    Frame(#[from] FrameError),
    /// The rendered pixels do not make an image of the picture's size.
    #[error("synthetic camera: {0}")]
    Image(#[from] ImageError),
    /// OpenCV refused an operation.
    #[error("synthetic camera: OpenCV: {0}")]
    OpenCv(#[from] opencv::Error),
}

/// Renders pictures of a [`Scene`].
#[derive(Debug, Clone)]
pub struct SyntheticCamera {
    camera: Camera,
    to_camera: Isometry3<f64>,
    light: CameraLight,
    sensor: Sensor,
    width: usize,
    height: usize,
    /// 8-bit BGR, without noise.
    colour: ColourImage,
    disparity: Vec<u16>,
    /// Distance of the background along the optical axis, metres; only where it may hide things.
    range: Option<Vec<f32>>,
    random: ChaCha8Rng,
    /// Disparity of the picture in work.
    work: Vec<u16>,
}

impl SyntheticCamera {
    /// A camera as `camera` says before `background`, with noise from `seed`.
    ///
    /// # Errors
    /// Where a number of the camera or the options cannot be, or the intrinsics do not fit the
    /// background's size.
    pub fn new(
        camera: Camera,
        background: Background,
        options: Options,
        seed: u64,
    ) -> Result<Self, SyntheticError> {
        let size = match &background {
            Background::Frame(frame) => (frame.colour().width(), frame.colour().height()),
            Background::Room(_) => (usize::from(options.width), usize::from(options.height)),
        };
        check(&camera, &options, size)?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sensor = Sensor::new(options.sensor, camera.intrinsics.depth_scale, size, &mut random)?;
        let (colour, disparity, range) = match background {
            Background::Frame(frame) => {
                (frame.colour().clone(), recorded(&frame, &sensor.disparity), None)
            }
            Background::Room(room) => {
                let view = room.cast(&camera, size);
                let disparity = view.disparity(&sensor, size.0, &mut random);
                let colour = view.colour.as_chunks().0.to_vec();
                let colour = Image::new(size.0, size.1, colour)?;
                (colour, disparity, Some(view.range))
            }
        };
        let to_camera = camera.pose.inverse();
        let light = CameraLight::new(&options.light, &to_camera.rotation);
        let work = disparity.clone();
        let (width, height) = size;
        Ok(Self {
            camera,
            to_camera,
            light,
            sensor,
            width,
            height,
            colour,
            disparity,
            range,
            random,
            work,
        })
    }

    /// The camera that the pictures are taken with.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Columns and rows of its pictures.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// A picture of `scene`, taken at `time` (seconds on the caller's clock).
    ///
    /// # Errors
    /// Where the time is not finite, the light not positive, or the blur not in 0 to 50 pixels.
    pub fn render(&mut self, time: f64, scene: &Scene) -> Result<RgbdFrame, SyntheticError> {
        require(
            "the scene's light",
            scene.light,
            scene.light > 0.0 && scene.light.is_finite(),
            "more than 0",
        )?;
        require(
            "the scene's blur",
            scene.blur,
            (0.0..=50.0).contains(&scene.blur),
            "0 to 50 pixels",
        )?;
        let mut colour = exposed(&self.colour, scene.light);
        let mut depth = Image::filled(self.width, self.height, 0);
        self.work.copy_from_slice(&self.disparity);
        let mut canvas = Canvas {
            width: self.width,
            height: self.height,
            colour: colour.channels_mut(),
            disparity: &mut self.work,
            sensor: &self.sensor.disparity,
            range: self.range.as_deref(),
        };
        let style = Style {
            intrinsics: &self.camera.intrinsics,
            light: &self.light,
            gain: scene.light,
            blur: scene.blur,
            holes: self.sensor.options.holes,
        };
        for item in items(scene, &self.to_camera, self.camera.ball_diameter) {
            match item.what {
                What::Ball(ball) => ball.draw(&mut canvas, &style, &mut self.random)?,
                What::Strand(strand) => strand.draw(&mut canvas, &style),
            }
        }
        let raw = depth.pixels_mut();
        self.sensor.finish(self.width, canvas.colour, canvas.disparity, raw, &mut self.random);
        Ok(RgbdFrame::new(time, colour, depth, self.camera.intrinsics)?)
    }
}

/// `colour` with `light` times the light.
fn exposed(colour: &ColourImage, light: f64) -> ColourImage {
    let mut lit = colour.clone();
    if light == 1.0 {
        return lit;
    }
    let table: Vec<u8> =
        (0..=255_u8).map(|value| encode(decode(value) * light).round() as u8).collect();
    lit.channels_mut().iter_mut().for_each(|value| *value = table[usize::from(*value)]);
    lit
}

/// Disparity of a recorded depth picture.
fn recorded(frame: &RgbdFrame, disparity: &Disparity) -> Vec<u16> {
    let scale = frame.intrinsics().depth_scale;
    let steps = frame.depth().pixels().iter().map(|&raw| match raw {
        0 => 0,
        raw => disparity.at_metres(f64::from(raw) / scale),
    });
    steps.collect()
}

fn require(
    what: &'static str,
    value: f64,
    holds: bool,
    must: &'static str,
) -> Result<(), SyntheticError> {
    if holds { Ok(()) } else { Err(SyntheticError::Value { what, value, must }) }
}

/// Refuses what would make no picture.
fn check(
    camera: &Camera,
    options: &Options,
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

#[cfg(test)]
mod tests;
