//! The suite `pair`: two webcams as one depth camera ([`plumb_vision::fuse`]).
//!
//! The cameras stand 0.6 m apart and 1.2 m from the ball, have 640x480 pixels and f = 533 px, and
//! run freely at 30 Hz, the second one up to 17 ms after the first. Stamps are off by up to ±3 ms.
//! Most circles are computed, with a noise of 0.2 pixels; in the rendered cases the detector finds
//! them.

mod case;
mod errors;
mod eyes;
mod knocks;
mod report;
mod stand;

use plumb_frame::source::BoxedError;

use super::timing::OneThread;
use case::CASES;

pub use report::{CaseReport, ErrorReport, KnockReport, PairReport};

/// Runs all cases with `frames` pictures of each camera, and rendered cases with a fifth. Calls
/// `progress` with the name of each case. OpenCV runs on one thread meanwhile.
///
/// # Errors
/// If rendering or a detector fails.
pub fn run(
    seed: u64,
    frames: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<PairReport, BoxedError> {
    let _one = OneThread::new()?;
    let mut cases = Vec::new();
    for (case, number) in CASES.iter().zip(0..) {
        progress(case.name);
        cases.push(stand::run(case, seed.wrapping_mul(1000).wrapping_add(number), frames)?);
    }
    progress("turned by 1°");
    let knocks = knocks::run(seed, frames)?;
    Ok(PairReport { suite: "pair", seed, frames, cases, knocks })
}

#[cfg(test)]
mod tests;
