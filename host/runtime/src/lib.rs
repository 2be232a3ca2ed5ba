//! Plumb's runtime: the rig file, the link to the board, the control loop, and the run log.
//!
//! [`plumb_cameras`] gives the pictures and [`plumb_vision`] finds the ball.
//!
//! ```text
//! camera -> RgbdFrame -> BallDetector -> BallObservation -> link -> board
//! ```
//!
//! The crate knows no simulation and no control law: the board computes all motor rates.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod link;
pub mod observer;
pub mod plot_colours;
pub mod queued;
pub mod recording;
pub mod replay;
pub mod rig;
pub mod run;
pub mod run_log;

/// The example in docs/change/add-observer.md is compiled and run with the other tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/change/add-observer.md")]
struct ObserverPage;
