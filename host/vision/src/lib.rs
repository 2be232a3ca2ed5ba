//! Finds a ball in RGB-D frames and localises it.
//!
//! ```text
//! RgbdFrame -> BallDetector -> BallObservation { stamp, circle, score, position }
//! ```
//!
//! - [`image`]: pixels in memory; [`frame`]: a colour image with registered depth.
//! - [`camera`]: the pinhole model with lens distortion, the pose in the rig frame and the ball's
//!   size and hue.
//! - [`detect`]: the detectors [`ball`](detect::ball) (the default; its stages and parameters are
//!   in [`shape`](detect::shape)), [`disc`](detect::disc) and [`red`](detect::red), and
//!   [`DetectorKind`](detect::DetectorKind), which makes one by name.
//! - [`observation`]: what a detector returns; [`debug`]: images of what each stage found.
//! - [`localise`]: from a circle in the image to a position in the rig frame with its covariance.
//! - [`fuse`]: two cameras as one: from the circles of both to positions with their covariance.
//! - [`render`]: a small renderer for tests and examples.
//!
//! [`camera`], [`frame`], [`image`], [`observation`], [`render`] and the detectors' interface are
//! those of [`plumb_frame`], which crates without a detector use by itself.
//!
//! The crate only computes: it reads no files, opens no devices, starts no threads, and has no
//! clock. It processes images with OpenCV, but no OpenCV type is in its interface.
//!
//! A red ball 0.8 m from the camera in front of a grey wall:
//!
//! ```
//! use nalgebra::{Isometry3, Point3};
//! use plumb_vision::camera::{Camera, Intrinsics};
//! use plumb_vision::detect::DetectorKind;
//! use plumb_vision::render::{Ball, Scene};
//!
//! let (fx, fy, cx, cy) = (525.0, 525.0, 319.5, 239.5);
//! let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion: None };
//! let pose = Isometry3::identity();
//! let camera = Camera::new(intrinsics, pose, 0.06);
//!
//! let centre = Point3::new(0.1, -0.05, 0.8);
//! let mut scene = Scene::wall(640, 480, intrinsics, 2.2);
//! scene.add(&Ball::red(centre, 0.03));
//!
//! let mut detector = DetectorKind::Ball.build(&camera);
//! let ball = detector.detect(&scene.frame(0.0)?)?.expect("there is a ball");
//! let position = ball.position.expect("it has depth");
//! assert!((position.mean - centre).norm() < 0.002);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod debug;
mod depth_view;
pub mod detect;
pub mod fuse;
pub mod localise;
mod mat;

pub use plumb_frame::{camera, frame, image, observation, render};
