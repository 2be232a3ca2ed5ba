//! Finds a camera's pose in the rig frame.
//!
//! Three ways, each from frames of the camera to a [`Calibration`](calibration::Calibration), which
//! has the pose, the residuals, the error on held-out samples, the outliers and what to do next:
//!
//! - [`board_pose`]: a printed [`board`] at a known place, found by [`corners`], and views of it
//!   that are averaged;
//! - [`motors`]: the pixels of the three motors, with depth;
//! - [`places`]: at least four known places of the ball.
//!
//! [`lens`] estimates intrinsics and distortion from views of the board.
//!
//! [`sheet`] draws the board for the printer at its true scale, [`overlay`] draws the result into
//! the picture, [`camera_text`] puts the pose into a camera file's text, and [`render`] draws the
//! board into synthetic frames.
//!
//! The crate reads no device and writes no file. It needs no module of OpenCV beyond those of the
//! rest of the program.
//!
//! The pose from a board that lies at the rig's origin:
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use plumb_calibrate::board::{CharucoSheet, Placement};
//! use plumb_calibrate::board_pose::pose_from_board;
//! use plumb_calibrate::board_pose::{BoardView, average};
//! use plumb_calibrate::corners::find_corners;
//! use plumb_calibrate::render::draw_board;
//! use plumb_frame::camera::Intrinsics;
//! use plumb_frame::render::Scene;
//!
//! // A camera 0.7 m above the board looks down, its rows turned against the board's.
//! let (fx, fy, cx, cy) = (525.0, 525.0, 319.5, 239.5);
//! let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 5000.0, distortion: None };
//! let board_to_camera = Isometry3::new(Vector3::new(-0.1, 0.1, 0.7), Vector3::new(2.7, 0.3, 0.1));
//! let mut scene = Scene::wall(640, 480, intrinsics, 2.0);
//! let images = (&mut scene.colour, &mut scene.depth);
//! draw_board(images, &intrinsics, &CharucoSheet::SHEET, &board_to_camera);
//! let frame = scene.frame(0.0)?;
//!
//! let corners = find_corners(frame.colour(), &CharucoSheet::SHEET)?;
//! let seen = average(&[BoardView::new(&corners, &frame)], &CharucoSheet::SHEET)?;
//! let found = pose_from_board(&seen, &intrinsics, &Placement::AT_ORIGIN)?;
//! let error = found.pose * board_to_camera;
//! assert!(error.translation.vector.norm() < 0.002 && error.rotation.angle() < 0.005);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod board;
pub mod board_pose;
pub mod calibration;
pub mod camera_text;
pub mod corners;
mod depth;
mod dictionary;
mod homography;
mod least_squares;
pub mod lens;
mod marker;
pub mod motors;
pub mod overlay;
pub mod places;
pub mod render;
mod rigid;
pub mod sheet;
