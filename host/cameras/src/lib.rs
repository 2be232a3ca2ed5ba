//! Plumb's cameras: sources of RGB-D pictures, recordings and their replay, and the camera file.
//!
//! - [`source`]: what a source is, a [camera](source::openni) or recording through OpenNI2, a
//!   [TUM RGB-D folder](source::tum), and a [recording in the time of its making](source::playback).
//! - [`record`]: a run's pictures as a TUM RGB-D folder.
//! - [`discovery`]: which cameras are there, and what they lack.
//! - [`camera_file`]: a camera's geometry. [`toml_file`] and [`bounded_read`] read it and other
//!   files that a person names.
//!
//! The crate knows no board, no rig and no simulation.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use plumb_cameras::camera_file;
//! use plumb_cameras::source::open_recording;
//!
//! let camera = camera_file::read(Path::new("desk/camera.toml"))?;
//! let mut recording = open_recording(Path::new("desk"), camera.intrinsics)?;
//! while let Some(frame) = recording.source.next_frame()? {
//!     println!("{:.3} s: {:?} m", frame.time(), frame.depth_at(320, 240));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod bounded_read;
pub mod camera_file;
pub mod discovery;
pub mod driver;
pub mod drivers;
pub mod record;
pub mod settings;
pub mod source;
pub mod toml_file;

/// The example in docs/change/add-camera.md is compiled and run with the other tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/change/add-camera.md")]
struct CamerasPage;
