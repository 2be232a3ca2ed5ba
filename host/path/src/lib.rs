//! Paths and trajectories of a ball in space.
//!
//! - [`trajectory`]: a [`Trajectory`] gives the ball's place, velocity and acceleration at a time.
//! - [`shape`]: shapes for trying: circle, line, figure of eight, square, spline.
//! - [`moving`]: a target that moves in the world.
//! - [`tracker`]: where such a target was and will be, by the places that somebody tells.
//! - [`file`](mod@file): places from tables and from G-code.
//! - [`check`](mod@check): whether a trajectory keeps its limits and stays where the ball may be.
//!
//! A path of waypoints is a chain of straight lines. Where waypoints are dense, some are left out
//! within the tolerance. Quintic Bézier curves round the corners, so that the curvature is
//! continuous. The speed along it follows from
//! [`MotionLimits`](trajectory::MotionLimits) by a backward and a forward pass over the arc length;
//! a moving average over time then bounds the jerk. The position is twice continuously
//! differentiable in time.
//!
//! Units are SI: metres in the rig frame, seconds. The crate reads no files, has no clock, and
//! knows no rig.
//!
//! ```
//! use nalgebra::Point3;
//! use plumb_path::trajectory::{MotionLimits, Run, Trajectory, Waypoints};
//!
//! let corners = [[0.3, 0.2, 0.3], [0.6, 0.2, 0.3], [0.6, 0.4, 0.3]];
//! let places = corners.map(Point3::from).to_vec();
//! let waypoints = Waypoints { places, speeds: Vec::new(), tolerance: 0.005 };
//! let limits = MotionLimits::with_speed(0.05);
//! let trajectory = Trajectory::through(&waypoints, &limits, Run::Once)?;
//! let end = trajectory.at(trajectory.duration());
//! assert!((end.position - Point3::new(0.6, 0.4, 0.3)).norm() < 1e-9);
//! assert_eq!(end.velocity.norm(), 0.0);
//! # Ok::<(), plumb_path::trajectory::PathError>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod check;
mod corner;
mod curve;
pub mod file;
mod gcode;
mod motion;
pub mod moving;
mod places;
mod profile;
mod quintic;
pub mod shape;
mod simplify;
mod spline;
mod table;
mod time_law;
mod timed;
pub mod tracker;
pub mod trajectory;

pub use trajectory::Trajectory;
