//! Plumb's runtime: drives a ball on three cables to its targets.
//!
//! - [`rig`]: the rig file, and the board's configuration that follows from it.
//! - [`link`]: the link to the board.
//! - [`run`]: a run: the control loop through a list of targets.
//! - [`record`]: the fields of a run's records, one name for one thing in every output.
//! - [`observer`]: the outputs of a run. [`bounded_observer`] gives an output a thread of its
//!   own; the run's folder and the [recording](observer::FrameRecorder) of frames are such outputs.
//! - [`operator`](mod@operator): commands from other threads to a run: targets, stop, hold, jog.
//! - [`targets`]: targets that move, from other programs and threads to a run.
//!
//! [`plumb_cameras`] delivers the frames. A detector, for example one of the crate `plumb-vision`,
//! finds the ball in them ([`plumb_frame`] has its interface):
//!
//! ```text
//! CameraSource -> RgbdFrame -> BallDetector -> BallObservation -> Link -> board
//!                                    every frame -> FrameRecord -> observers
//! ```
//!
//! The crate contains no simulation and no control law: the board computes all motor rates.
//!
//! ```no_run
//! use plumb_runtime::rig::Rig;
//! use plumb_runtime::run::{Run, RunParts};
//! use plumb_vision::detect::DetectorKind;
//!
//! let rig = Rig::read("rig.toml".as_ref())?;
//! let mut camera = rig.camera.open()?;
//! let mut detector = DetectorKind::Ball.build(&camera.camera);
//! let parts = RunParts::new(&mut *camera.source, &mut *detector);
//! let summary = Run::open(&rig)?.drive(parts)?;
//! println!("{}", summary.ending);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod board_fault;
pub mod board_report;
pub mod bounded_observer;
mod deviation;
pub mod doubt;
mod event;
#[doc(hidden)]
pub mod fuzzing;
pub mod link;
pub mod listening;
pub mod observer;
pub mod operator;
pub mod record;
pub mod reference;
pub mod rig;
pub mod rounding;
pub mod run;
mod stop_reason;
mod summary;
pub mod targets;
mod targets_summary;
pub mod wakeups;
pub mod wall_clock;

/// The example in docs/change/add-observer.md is compiled and run with the other tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/change/add-observer.md")]
struct ObserverPage;
