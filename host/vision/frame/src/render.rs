//! A small renderer of balls, for tests, examples and documentation.
//!
//! It draws a shaded ball with a specular highlight, and its depth, in front of a wall. It has no
//! noise, no shadows and no anti-aliasing: the synthetic camera of the simulation has.

use nalgebra::{Point3, Vector3};

use crate::camera::Intrinsics;
use crate::frame::{FrameError, RgbdFrame};
use crate::image::{Bgr, ColourImage, DepthImage, Image};

/// Colour of the wall, grey levels.
const WALL: u8 = 120;
/// Direction to the light, camera axes: from the upper left, behind the camera.
const LIGHT: Vector3<f64> = Vector3::new(-0.5, -0.7, -0.5);
/// Light that reaches all of the ball, as a part of the full light.
const AMBIENT: f64 = 0.35;
/// Light from the direction of [`LIGHT`].
const DIFFUSE: f64 = 0.7;
/// Brightness of the highlight.
const SPECULAR: f64 = 0.5;
/// Sharpness of the highlight: exponent of Blinn's model.
const SHININESS: i32 = 40;

/// A ball to be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre, camera axes, metres.
    pub centre: Point3<f64>,
    /// Radius, metres.
    pub radius: f64,
    /// Blue, green and red where it is fully lit, 0 to 1.
    pub albedo: [f64; 3],
    /// Brightness of the light; 1 is usual.
    pub light: f64,
}

impl Ball {
    /// Makes a red ball.
    pub fn red(centre: Point3<f64>, radius: f64) -> Self {
        Self { centre, radius, albedo: [0.12, 0.08, 0.8], light: 1.0 }
    }

    /// Returns the colour of the ball where `ray` (camera axes, z = 1) meets it at depth `z`,
    /// metres.
    fn shade(&self, ray: &Vector3<f64>, z: f64) -> Bgr {
        let light = LIGHT.normalize();
        let normal = (ray * z - self.centre.coords) / self.radius;
        let diffuse = AMBIENT + DIFFUSE * normal.dot(&light).max(0.0);
        let half = (light - ray.normalize()).normalize();
        let specular = SPECULAR * normal.dot(&half).max(0.0).powi(SHININESS);
        self.albedo
            .map(|albedo| (255.0 * self.light * (albedo * diffuse + specular)).min(255.0) as u8)
    }
}

/// Returns the depth along the optical axis, metres, at which `ray` (camera axes, z = 1) first
/// meets the sphere of `radius` about `centre` (metres); `None` if it misses the sphere.
#[inline]
pub fn sphere_depth(ray: &Vector3<f64>, centre: &Vector3<f64>, radius: f64) -> Option<f64> {
    // The smaller root of |z ray - centre|² = radius².
    let (a, b) = (ray.norm_squared(), ray.dot(centre));
    let discriminant = b * b - a * (centre.norm_squared() - radius * radius);
    (discriminant >= 0.0).then(|| (b - discriminant.sqrt()) / a)
}

/// An RGB-D image that is drawn into.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Colour, 8-bit BGR.
    pub colour: ColourImage,
    /// Depth in the units of the intrinsics.
    pub depth: DepthImage,
    /// Intrinsics of both images.
    pub intrinsics: Intrinsics,
}

impl Scene {
    /// Makes a grey wall at `distance` metres, across the optical axis.
    pub fn wall(width: usize, height: usize, intrinsics: Intrinsics, distance: f64) -> Self {
        let raw = (distance * intrinsics.depth_scale).round() as u16;
        let (colour, depth) = (Image::filled(width, height, [WALL; 3]), raw);
        Self { colour, depth: Image::filled(width, height, depth), intrinsics }
    }

    /// Draws a ball in front of what was drawn before.
    pub fn add(&mut self, ball: &Ball) {
        self.each_pixel(|intrinsics, (u, v), colour, depth| {
            let ray = intrinsics.deproject(f64::from(u), f64::from(v), 1.0).coords;
            if let Some(z) = sphere_depth(&ray, &ball.centre.coords, ball.radius) {
                *colour = ball.shade(&ray, z);
                *depth = (z * intrinsics.depth_scale).round() as u16;
            }
        });
    }

    /// Calls `f` with the intrinsics, column and row, colour and depth of each pixel.
    pub fn each_pixel(&mut self, f: impl Fn(&Intrinsics, (i32, i32), &mut Bgr, &mut u16)) {
        let width = self.colour.width();
        let pixels = self.colour.pixels_mut().iter_mut().zip(self.depth.pixels_mut());
        for (i, (colour, depth)) in pixels.enumerate() {
            f(&self.intrinsics, ((i % width) as i32, (i / width) as i32), colour, depth);
        }
    }

    /// Returns the frame, taken at `time`, seconds.
    ///
    /// # Errors
    /// Returns an error if the images differ in size or `time` is not finite.
    pub fn frame(&self, time: f64) -> Result<RgbdFrame, FrameError> {
        RgbdFrame::new(time, self.colour.clone(), self.depth.clone(), self.intrinsics)
    }
}
