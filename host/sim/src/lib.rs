//! Plumb without hardware: an emulated board that moves a simulated rig, a camera that renders it,
//! and co-simulation with other physics engines.
//!
//! - [`simulated`]: a simulated rig as a camera source, in virtual or real time.
//! - [`synthetic`]: the renderer: ball, cables, room, and the noise of an RGB-D sensor.
//! - [`memory`]: a transport to an emulated board in memory.
//! - [`led_port`]: a port to an emulated board in another program, which waits for this one.
//! - [`cosim`]: the board in lock step with another physics engine.
//! - [`limits`]: a board configuration with wide limits.
//!
//! [`plumb_emulator`] is part of this crate's interface and exported as [`emulator`].
//!
//! ```
//! use plumb_sim::emulator::plant::Task;
//! use plumb_sim::synthetic::{Background, RenderOptions, Room, Scene, SyntheticCamera};
//!
//! let camera = plumb_cameras::camera_file::paper()?;
//! let (task, background) = (Task::paper(), Background::Room(Room::furnished()));
//! let mut synthetic = SyntheticCamera::new(camera, background, RenderOptions::default(), 1)?;
//! let frame = synthetic.render(0.0, &Scene::rig(task.start, *task.geometry.motors()))?;
//! assert_eq!((frame.colour().width(), frame.colour().height()), (640, 480));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod cosim;
pub mod led_port;
pub mod limits;
pub mod memory;
pub mod simulated;
pub mod synthetic;

pub use plumb_emulator as emulator;
