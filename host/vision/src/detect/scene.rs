//! Scenes for tests, with what spoils the view of a ball.

use std::path::PathBuf;

use nalgebra::{Isometry3, Point3};
use opencv::core::{Mat, MatTraitConstManual, Point, Scalar, Size, Vec3b};
use opencv::imgproc::{LINE_AA, gaussian_blur_def, line};

use crate::camera::{Camera, Intrinsics};
use crate::mat::borrow_colour;
use crate::observation::Circle;
use crate::render::{Ball, Scene};

/// Intrinsics of the rendered scenes, and of the pictures in the folder `osd`.
pub(super) const INTRINSICS: Intrinsics = Intrinsics {
    fx: 525.0,
    fy: 525.0,
    cx: 319.5,
    cy: 239.5,
    depth_scale: 5000.0,
    distortion: None,
};

/// Returns the camera of those pictures, with a red ball of 60 mm.
pub(super) fn camera() -> Camera {
    let pose = Isometry3::identity();
    Camera::new(INTRINSICS, pose, 0.06)
}

/// Returns a red ball of 60 mm.
pub(super) fn red_ball(centre: Point3<f64>) -> Ball {
    Ball::red(centre, 0.03)
}

/// Returns a grey wall at `distance` metres.
pub(super) fn wall(distance: f64) -> Scene {
    Scene::wall(640, 480, INTRINSICS, distance)
}

/// Returns the circle that a ball is seen as.
pub(super) fn seen(ball: &Ball, intrinsics: &Intrinsics) -> Circle {
    let (u, v) = intrinsics.project(&ball.centre).unwrap();
    Circle::rough(u, v, intrinsics.fx * ball.radius / ball.centre.z)
}

/// Disturbances of the view of a ball.
pub(super) trait Disturbances {
    /// Draws a cable across (`u`, `v`).
    fn add_cable(&mut self, at: (f64, f64), angle: f64, width: i32, grey: f64);
    /// Blurs the image as if out of focus.
    fn blur(&mut self, sigma: f64);
    /// Adds noise of up to `amplitude` grey levels either way, the same at each call.
    fn add_noise(&mut self, amplitude: i32);
}

impl Disturbances for Scene {
    fn add_cable(&mut self, (u, v): (f64, f64), angle: f64, width: i32, grey: f64) {
        let end =
            |way: f64| Point::new((u + way * angle.cos()) as i32, (v + way * angle.sin()) as i32);
        let [rows, columns] = [self.colour.height(), self.colour.width()].map(|n| n as i32);
        let bytes = self.colour.channels_mut();
        let mut mat = Mat::new_rows_cols_with_bytes_mut::<Vec3b>(rows, columns, bytes).unwrap();
        line(&mut mat, end(-800.0), end(800.0), Scalar::all(grey), width, LINE_AA, 0).unwrap();
    }

    fn blur(&mut self, sigma: f64) {
        let mut blurred = Mat::default();
        let sharp = borrow_colour(&self.colour).unwrap();
        gaussian_blur_def(&sharp, &mut blurred, Size::default(), sigma).unwrap();
        self.colour.channels_mut().copy_from_slice(blurred.data_bytes().unwrap());
    }

    fn add_noise(&mut self, amplitude: i32) {
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
}

/// Returns the folder `name` of real pictures: in the folder that the environment variable
/// PLUMB_DATA names, or beside the repository. Returns `None` and says so if it is absent, which is
/// a failure with CI set.
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
