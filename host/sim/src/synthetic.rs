//! A synthetic camera: renders the rig's ball and cables, with the noise of a depth sensor, into a
//! recorded frame or a furnished room.
//!
//! The same seed and the same calls give the same frames, bit for bit.

mod ball;
mod canvas;
mod check;
pub mod compositor;
mod draw_list;
mod error;
mod light;
mod options;
mod room;
mod scene;
mod sensor;
mod strand;

use nalgebra::Isometry3;
use plumb_frame::camera::Camera;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{ColourImage, Image};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use ball::Style;
use canvas::Canvas;
use check::{check, require};
use draw_list::{Primitive, items};
use light::{CameraLight, decode, encode};
use sensor::{Disparity, Sensor};

pub use error::SyntheticError;
pub use light::{Light, Material};
pub use options::RenderOptions;
pub use room::{Object, Pattern, Room, Shape};
pub use scene::{ExtraBall, Scene, Strand};
pub use sensor::SensorOptions;

/// Background of the scene.
#[derive(Debug, Clone)]
pub enum Background {
    /// A recorded frame; everything is drawn in front of it. Its own intrinsics scale its depth;
    /// the camera's intrinsics project the scene.
    Frame(RgbdFrame),
    /// A room, rendered once from the camera's pose. Its objects occlude the scene behind them.
    Room(Room),
}

/// Renders frames of a [`Scene`].
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
    /// Distance of the background along the optical axis, metres; `None` if it occludes nothing.
    range: Option<Vec<f32>>,
    random: ChaCha8Rng,
    /// Disparity of the frame in work.
    work: Vec<u16>,
}

impl SyntheticCamera {
    /// Checks that `camera` can be rendered in a room with `options`, as [`new`](Self::new) does.
    ///
    /// # Errors
    /// Where a number of the camera or the options cannot be.
    pub fn check(camera: &Camera, options: &RenderOptions) -> Result<(), SyntheticError> {
        check(camera, options, (usize::from(options.width), usize::from(options.height)))
    }

    /// Returns a synthetic camera with the model `camera` before `background`, with noise from
    /// `seed`.
    ///
    /// # Errors
    /// Where a number of the camera or the options cannot be, or the intrinsics do not fit the
    /// background's size.
    pub fn new(
        camera: Camera,
        background: Background,
        options: RenderOptions,
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
                let view = room.render(&camera, size);
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

    /// The camera that the frames are taken with.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Columns and rows of its frames.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Returns a frame of `scene`, taken at `time` (seconds on the caller's clock).
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
            match item.primitive {
                Primitive::Ball(ball) => ball.draw(&mut canvas, &style, &mut self.random)?,
                Primitive::Strand(strand) => strand.draw(&mut canvas, &style),
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

/// Disparity of a recorded depth image.
fn recorded(frame: &RgbdFrame, disparity: &Disparity) -> Vec<u16> {
    let scale = frame.intrinsics().depth_scale;
    let steps = frame.depth().pixels().iter().map(|&raw| match raw {
        0 => 0,
        raw => disparity.at_metres(f64::from(raw) / scale),
    });
    steps.collect()
}

#[cfg(test)]
mod tests;
