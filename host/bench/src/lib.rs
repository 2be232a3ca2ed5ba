//! Benchmarks of control and vision. Every result can be repeated from a seed.
//!
//! - [`calibration`]: the ways of `plumb calibrate` on simulated rigs.
//! - [`control`]: control laws, baselines and references on simulated rigs.
//! - [`stream`]: frames that another program sends, in real time.
//! - [`vision`]: detectors on synthetic and composited frames.
//!
//! ```
//! use plumb_bench::control::{self, ControllerKind, Suite, SuiteName};
//!
//! let controller: ControllerKind = "adaptive".parse()?;
//! let suite = Suite::new(SuiteName::QuasiStatic);
//! let reports = control::run(&controller, &suite, 0..2, 1, &mut |done| println!("{done} done"))?;
//! assert_eq!(reports[0].converged, 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod calibration;
pub mod control;
mod run_id;
pub mod stream;
pub mod vision;

/// Error of parsing a name that is not in the list of known names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("one of {0}")]
pub struct UnknownName(String);

impl UnknownName {
    /// Creates the error from the known names.
    fn new<T: ToString>(known: impl IntoIterator<Item = T>) -> Self {
        let known: Vec<String> = known.into_iter().map(|name| name.to_string()).collect();
        Self(known.join(", "))
    }
}
