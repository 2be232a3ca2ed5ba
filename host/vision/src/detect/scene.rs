//! Balls for tests: a shaded sphere and its depth, put into a picture.

use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, Vector3};
use opencv::core::{Mat, MatTraitConstManual, Point, Scalar, Size, Vec3b};
use opencv::imgproc::{LINE_AA, gaussian_blur_def, line};

use crate::camera::{Camera, Intrinsics};
use crate::frame::RgbdFrame;
use crate::image::{Bgr, ColourImage, DepthImage, Image};
use crate::mat::borrow_colour;
use crate::observation::Circle;

/// Of the plain pictures, and of those in the folder `osd`.
pub(super) const INTRINSICS: Intrinsics =
    Intrinsics { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5, depth_scale: 5000.0 };

/// The camera of those pictures, with a red ball of 60 mm.
pub(super) fn camera() -> Camera {
    let pose = Isometry3::identity();
    Camera { intrinsics: INTRINSICS, pose, ball_diameter: 0.06, ball_hue: 0.0 }
}

/// A picture that is being made.
#[derive(Clone)]
pub(super) struct Scene {
    pub(super) colour: ColourImage,
    pub(super) depth: DepthImage,
    pub(super) intrinsics: Intrinsics,
}

/// A ball to be put into it.
#[derive(Clone, Copy)]
pub(super) struct Sphere {
    pub(super) centre: Point3<f64>,
    pub(super) radius: f64,
    /// Blue, green, red where it is lit fully, 0 to 1.
    pub(super) albedo: [f64; 3],
    /// Brightness, 1 as usual.
    pub(super) light: f64,
}

impl Sphere {
    /// A red ball of 60 mm.
    pub(super) fn red(centre: Point3<f64>) -> Self {
        Self { centre, radius: 0.03, albedo: [0.12, 0.08, 0.8], light: 1.0 }
    }

    /// As it should be seen.
    pub(super) fn seen(&self, intrinsics: &Intrinsics) -> Circle {
        let (u, v) = intrinsics.project(&self.centre).unwrap();
        Circle::rough(u, v, intrinsics.fx * self.radius / self.centre.z)
    }
}

impl Scene {
    /// A grey wall at `distance` metres.
    pub(super) fn wall(distance: f64) -> Self {
        let colour = Image::filled(640, 480, [120; 3]);
        let depth = Image::filled(640, 480, (distance * INTRINSICS.depth_scale).round() as u16);
        Self { colour, depth, intrinsics: INTRINSICS }
    }

    /// Puts a ball into it, lit from the upper left, with a specular highlight.
    pub(super) fn add(&mut self, ball: &Sphere) {
        let sun = Vector3::new(-0.5, -0.7, -0.5).normalize();
        self.each_pixel(|intrinsics, (u, v), pixel, depth| {
            let ray = intrinsics.deproject(f64::from(u), f64::from(v), 1.0).coords;
            let (a, b) = (ray.norm_squared(), ray.dot(&ball.centre.coords));
            let root = b * b - a * (ball.centre.coords.norm_squared() - ball.radius * ball.radius);
            if root < 0.0 {
                return;
            }
            let z = (b - root.sqrt()) / a;
            let normal = (ray * z - ball.centre.coords) / ball.radius;
            let diffuse = 0.35 + 0.7 * normal.dot(&sun).max(0.0);
            let half = (sun - ray.normalize()).normalize();
            let specular = 0.5 * normal.dot(&half).max(0.0).powi(40);
            for (channel, albedo) in pixel.iter_mut().zip(ball.albedo) {
                *channel = (255.0 * ball.light * (albedo * diffuse + specular)).min(255.0) as u8;
            }
            *depth = (z * intrinsics.depth_scale).round() as u16;
        });
    }

    /// Calls `f` with the intrinsics, column and row, colour and depth of each pixel.
    pub(super) fn each_pixel(&mut self, f: impl Fn(&Intrinsics, (i32, i32), &mut Bgr, &mut u16)) {
        let width = self.colour.width() as i32;
        let (pixels, depths) = (self.colour.pixels_mut(), self.depth.pixels_mut());
        for (i, (pixel, depth)) in pixels.iter_mut().zip(depths).enumerate() {
            f(&self.intrinsics, (i as i32 % width, i as i32 / width), pixel, depth);
        }
    }

    /// A line across (`u`, `v`), as a cable in front.
    pub(super) fn add_cable(&mut self, (u, v): (f64, f64), angle: f64, width: i32, grey: f64) {
        let end =
            |way: f64| Point::new((u + way * angle.cos()) as i32, (v + way * angle.sin()) as i32);
        let [rows, columns] = [self.colour.height(), self.colour.width()].map(|n| n as i32);
        let bytes = self.colour.channels_mut();
        let mut mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, columns, bytes).unwrap();
        line(&mut mat, end(-800.0), end(800.0), Scalar::all(grey), width, LINE_AA, 0).unwrap();
    }

    /// Out of focus.
    pub(super) fn blur(&mut self, sigma: f64) {
        let mut blurred = Mat::default();
        let sharp = borrow_colour(&self.colour).unwrap();
        gaussian_blur_def(&sharp, &mut blurred, Size::default(), sigma).unwrap();
        self.colour.channels_mut().copy_from_slice(blurred.data_bytes().unwrap());
    }

    /// Noise of up to `amplitude` grey levels either way, the same at each call.
    pub(super) fn add_noise(&mut self, amplitude: i32) {
        let hash = |u: i32, v: i32, c: usize| {
            let mixed = (u as u32).wrapping_mul(0x9E37_79B1) ^ (v as u32).wrapping_mul(0x85EB_CA77);
            let mixed = (mixed ^ (mixed >> 15)).wrapping_add(c as u32).wrapping_mul(0xC2B2_AE3D);
            (mixed >> 16) as i32
        };
        self.each_pixel(|_, (u, v), pixel, _| {
            for (c, channel) in pixel.iter_mut().enumerate() {
                let noise = hash(u, v, c) % (2 * amplitude + 1) - amplitude;
                *channel = (i32::from(*channel) + noise).clamp(0, 255) as u8;
            }
        });
    }

    pub(super) fn frame(&self) -> RgbdFrame {
        RgbdFrame::new(0.0, self.colour.clone(), self.depth.clone(), self.intrinsics).unwrap()
    }
}

/// The folder `name` of real pictures: in the folder that the environment variable PLUMB_DATA
/// names, or beside the repository. `None`, said aloud, where it is absent, which is a failure with
/// CI set.
pub(super) fn pictures(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("PLUMB_DATA").map_or_else(beside, PathBuf::from).join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is absent; set PLUMB_DATA", folder.display());
    println!("skipped: {} is absent; set PLUMB_DATA", folder.display());
    None
}
