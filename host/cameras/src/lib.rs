//! Plumb's cameras: sources of RGB-D frames, recordings, and the camera file.
//!
//! - [`settings`]: the registry of all sources, and the settings that choose one;
//!   [`open_camera`](open::open_camera) opens it. Each kind of camera is a crate (`plumb-openni`,
//!   `plumb-realsense`, `plumb-webcam`) or a module ([`stream`], [`http`]) with a
//!   [`CameraDriver`](plumb_frame::driver::CameraDriver). Of cameras in ROS 2 the table is here
//!   ([`ros2`]), the driver in the crate `plumb-ros2`.
//! - [`capture`]: a thread that reads a camera and keeps the newest frame.
//! - [`recording`]: recordings of any format; [`tum`]: TUM RGB-D folders; [`playback`]: recordings
//!   in the place of a camera; [`record`]: recording of frames as a TUM RGB-D folder.
//! - [`discovery`]: the cameras that are plugged in, and what is missing to use them.
//! - [`png`]: PNG files. The crate `plumb-pictures` decodes and encodes pictures.
//! - [`camera_file`]: intrinsics and pose of a camera, and the ball.
//!
//! The crate contains no board, no rig and no simulation.
//!
//! # Read a recording
//!
//! ```
//! use std::path::Path;
//!
//! use plumb_cameras::camera_file;
//! use plumb_cameras::record::{Overflow, RecordFolder};
//! use plumb_cameras::recording::open_recording;
//! use plumb_frame::frame::RgbdFrame;
//! use plumb_frame::image::Image;
//!
//! // Record a frame of a wall 2 m away.
//! let folder = std::env::temp_dir().join(format!("plumb-example-{}", std::process::id()));
//! let camera = camera_file::paper()?;
//! let (colour, depth) = (Image::filled(640, 480, [120; 3]), Image::filled(640, 480, 10_000));
//! let frame = RgbdFrame::new(0.0, colour, depth, camera.intrinsics)?;
//! let recording = RecordFolder::create(&folder)?;
//! let mut recorder = recording.begin(camera_file::PAPER, &camera.intrinsics, Overflow::Block)?;
//! recorder.add(&frame);
//! recorder.finish()?;
//!
//! // Read it back.
//! let camera = camera_file::read(&folder.join("camera.toml"))?;
//! let mut recording = open_recording(&folder, camera.intrinsics)?;
//! while let Some(frame) = recording.source.next_frame()? {
//!     assert_eq!(frame.depth_at(320, 240), Some(2.0));
//! }
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Open a camera
//!
//! ```no_run
//! use plumb_cameras::settings::CameraSettings;
//!
//! let mut opened = CameraSettings::new("camera.toml").open()?;
//! println!("{}", opened.description.unwrap_or_default());
//! while let Some(frame) = opened.source.next_frame()? {
//!     let age = opened.source.now() - frame.time();
//!     println!("{age:.3} s ago: {:?} m", frame.depth_at(320, 240));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod camera_file;
pub mod capture;
pub mod discovery;
#[doc(hidden)]
pub mod fuzzing;
pub mod http;
pub mod open;
pub mod playback;
pub mod png;
pub mod record;
pub mod recording;
pub mod ros2;
pub mod settings;
pub mod stream;
pub mod tum;

/// The example in docs/change/add-camera.md is compiled and run with the other tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/change/add-camera.md")]
struct CamerasPage;
