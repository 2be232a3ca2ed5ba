//! RGB-D frames, the camera model, the observation of a ball; the interfaces of a detector and of
//! a camera.
//!
//! ```text
//! RgbdFrame -> BallDetector -> BallObservation { stamp, circle, score, position }
//! ```
//!
//! - [`image`]: pixels in memory; [`frame`]: a colour image with registered depth.
//! - [`camera`]: the pinhole model with lens distortion, the pose in the rig frame and the ball's
//!   size and hue.
//! - [`detect`]: the interface [`BallDetector`](detect::BallDetector); the detectors are in the
//!   crate `plumb-vision`.
//! - [`observation`]: what a detector returns.
//! - [`source`]: the interface [`CameraSource`](source::CameraSource) of a camera or recording;
//!   [`driver`]: the interface of a kind of camera. The crate `plumb-cameras` has the registry.
//! - [`clock`]: clocks of sources, and the mapping of time stamps to the host's clock; [`pairing`]:
//!   pairs of colour and depth; [`file_intrinsics`]: whether the intrinsics of a camera file fit
//!   the pictures of a source.
//! - [`render`]: a small renderer for tests and examples.
//!
//! Crates that take or deliver frames (cameras, the control loop, the simulation) need this crate
//! only. It reads no files, opens no devices and starts no threads.
//!
//! A detector that takes the brightest pixel for the centre of the ball:
//!
//! ```
//! use nalgebra::Point3;
//! use plumb_frame::camera::Intrinsics;
//! use plumb_frame::detect::{BallDetector, DetectError};
//! use plumb_frame::frame::RgbdFrame;
//! use plumb_frame::observation::{BallObservation, Circle};
//! use plumb_frame::render::{Ball, Scene};
//!
//! struct Brightest;
//!
//! impl BallDetector for Brightest {
//!     fn name(&self) -> &'static str {
//!         "brightest"
//!     }
//!
//!     fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
//!         let (colour, stamp) = (frame.colour(), frame.time());
//!         let brightness = |pixel: &[u8; 3]| pixel.iter().map(|&c| u32::from(c)).sum::<u32>();
//!         let pixels = colour.pixels().iter().enumerate();
//!         Ok(pixels.max_by_key(|(_, pixel)| brightness(pixel)).map(|(i, pixel)| {
//!             let (u, v) = ((i % colour.width()) as f64, (i / colour.width()) as f64);
//!             let circle = Circle::rough(u, v, 10.0);
//!             let score = f64::from(brightness(pixel)) / 765.0;
//!             BallObservation { stamp, circle, score, position: None, depths: None }
//!         }))
//!     }
//! }
//!
//! let (fx, fy, cx, cy) = (525.0, 525.0, 319.5, 239.5);
//! let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion: None };
//! let mut scene = Scene::wall(640, 480, intrinsics, 2.2);
//! scene.add(&Ball { albedo: [1.0; 3], ..Ball::red(Point3::new(0.1, -0.05, 0.8), 0.03) });
//!
//! let ball = Brightest.detect(&scene.frame(0.0)?)?.expect("there is a ball");
//! assert!((ball.circle.u - 385.0).abs() < 20.0 && (ball.circle.v - 207.0).abs() < 20.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod camera;
pub mod clock;
pub mod detect;
mod distortion;
pub mod driver;
pub mod file_intrinsics;
pub mod frame;
mod geometry;
pub mod image;
pub mod observation;
pub mod pairing;
pub mod render;
pub mod source;
