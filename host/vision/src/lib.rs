//! Finds a ball in RGB-D frames and localises it.
//!
//! ```text
//! RgbdFrame -> BallDetector -> BallObservation { stamp, circle, score, position }
//! ```
//!
//! - [`image`]: pixels in memory; [`frame`]: a colour image with registered depth.
//! - [`camera`]: the pinhole model, the pose in the rig frame and the ball's size and hue.
//! - [`detect`]: the detectors [`shape`](detect::shape) (`ball`, the default) and
//!   [`red`](detect::red), and [`DetectorKind`](detect::DetectorKind), which makes one by name.
//! - [`observation`]: what a detector returns; [`debug`]: images of what each stage found.
//! - [`localise`]: from a circle in the image to a position in the rig frame with its covariance.
//!
//! The crate only computes: it reads no files, opens no devices, starts no threads, and has no
//! clock. It processes images with OpenCV, but no OpenCV type is in its interface.
//!
//! A red ball 0.8 m from the camera in front of a grey wall:
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use plumb_vision::camera::{Camera, Intrinsics};
//! use plumb_vision::detect::DetectorKind;
//! use plumb_vision::frame::RgbdFrame;
//! use plumb_vision::image::Image;
//!
//! let intrinsics = Intrinsics { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5, depth_scale: 1000.0 };
//! let pose = Isometry3::identity();
//! let camera = Camera { intrinsics, pose, ball_diameter: 0.06, ball_hue: 0.0 };
//!
//! let (mut colour, mut depth) = (vec![[120; 3]; 640 * 480], vec![2200; 640 * 480]);
//! let (centre, radius) = (Vector3::new(0.1, -0.05, 0.8), 0.03);
//! for i in 0..640 * 480 {
//!     // The nearer intersection of the pixel's ray with the sphere.
//!     let ray = intrinsics.deproject((i % 640) as f64, (i / 640) as f64, 1.0).coords;
//!     let (a, b) = (ray.norm_squared(), ray.dot(&centre));
//!     let root = b * b - a * (centre.norm_squared() - radius * radius);
//!     if root >= 0.0 {
//!         let z = (b - root.sqrt()) / a;
//!         let facing = (centre - ray * z).normalize().z;
//!         colour[i] = [25, 15, (200.0 * (0.4 + 0.6 * facing)) as u8];
//!         depth[i] = (1000.0 * z) as u16;
//!     }
//! }
//!
//! let (colour, depth) = (Image::new(640, 480, colour)?, Image::new(640, 480, depth)?);
//! let frame = RgbdFrame::new(0.0, colour, depth, intrinsics)?;
//! let mut detector = DetectorKind::Ball.build(&camera);
//! let ball = detector.detect(&frame)?.expect("there is a ball");
//! let position = ball.position.expect("it has depth");
//! assert!((position.mean.coords - centre).norm() < 0.002);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod camera;
pub mod debug;
mod depth_view;
pub mod detect;
pub mod frame;
pub mod image;
pub mod localise;
mod mat;
pub mod observation;
