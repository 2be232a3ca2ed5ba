//! Finds a ball in RGB-D pictures and works out where it is.
//!
//! ```text
//! RgbdFrame -> Detector::detect -> Detection -> locate -> Located { position, covariance }
//! ```
//!
//! - [`frame`]: a colour picture with the depth registered to it.
//! - [`camera`]: the pinhole model, the pose in the rig frame and the ball's size and hue.
//! - [`detect`]: the detectors, [`ball`](detect::ball) (the default) and [`red`](detect::red).
//! - [`locate`]: from a detection to a position in the rig frame with its covariance.
//!
//! The crate computes only. It reads no file, opens no device, starts no thread and knows no
//! clock, no board and no run: those are the program's, which also reads camera files.
//!
//! A grey wall with a red ball 0.8 m before the camera:
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use opencv::core::{CV_8UC3, CV_16UC1, Mat, MatTrait, Scalar, Vec3b};
//! use plumb_vision::camera::{Camera, Intrinsics};
//! use plumb_vision::detect::{Detector, ball::Ball};
//! use plumb_vision::frame::RgbdFrame;
//! use plumb_vision::locate::locate;
//!
//! let intrinsics = Intrinsics { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5, depth_scale: 1000.0 };
//! let pose = Isometry3::identity();
//! let camera = Camera { intrinsics, pose, ball_diameter: 0.06, ball_hue: 0.0 };
//!
//! let mut colour = Mat::new_rows_cols_with_default(480, 640, CV_8UC3, Scalar::all(120.0))?;
//! let mut depth = Mat::new_rows_cols_with_default(480, 640, CV_16UC1, Scalar::all(2200.0))?;
//! let (centre, radius) = (Vector3::new(0.1, -0.05, 0.8), 0.03);
//! for v in 0..480 {
//!     for u in 0..640 {
//!         // The nearer intersection of the pixel's ray with the sphere.
//!         let ray = intrinsics.deproject(f64::from(u), f64::from(v), 1.0).coords;
//!         let (a, b) = (ray.norm_squared(), ray.dot(&centre));
//!         let root = b * b - a * (centre.norm_squared() - radius * radius);
//!         if root >= 0.0 {
//!             let z = (b - root.sqrt()) / a;
//!             let facing = (centre - ray * z).normalize().z;
//!             *colour.at_2d_mut::<Vec3b>(v, u)? =
//!                 Vec3b::from([25, 15, (200.0 * (0.4 + 0.6 * facing)) as u8]);
//!             *depth.at_2d_mut::<u16>(v, u)? = (1000.0 * z) as u16;
//!         }
//!     }
//! }
//!
//! let frame = RgbdFrame::new(0.0, colour, depth, intrinsics)?;
//! let detection = Ball::for_camera(&camera).detect(&frame)?.expect("there is a ball");
//! let located = locate(&detection, &frame, &camera).expect("it has depth");
//! assert!((located.position.coords - centre).norm() < 0.002);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod camera;
pub mod detect;
pub mod frame;
pub mod locate;
