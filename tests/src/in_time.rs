//! Runs in real time on a busy machine.

use std::error::Error;

use plumb_runtime::link::LinkError;
use plumb_runtime::run::{ControlLoopError, RunError};

/// Most runs of [`in_time`].
const ATTEMPTS: usize = 6;

/// Returns the result of the first run in which every process got its time. Where the other side of
/// the link gets none for some seconds, the link breaks; that says nothing about the run.
///
/// # Errors
/// Any other error of a run; that of the last attempt.
pub fn in_time<T>(mut run: impl FnMut() -> Result<T, Box<dyn Error>>) -> Result<T, Box<dyn Error>> {
    for _ in 1..ATTEMPTS {
        match run() {
            Err(error) if is_late(&*error) => println!("once more: {error:?}"),
            result => return result,
        }
    }
    run()
}

/// Returns whether a run has ended since the other side of its link was late.
fn is_late(error: &(dyn Error + 'static)) -> bool {
    let link = match error.downcast_ref() {
        Some(RunError::Broken { error: ControlLoopError::Link(link), .. }) => link,
        Some(RunError::Connect(link)) => link,
        _ => return false,
    };
    matches!(
        link,
        LinkError::Silent { .. } | LinkError::Lagging { .. } | LinkError::NoTelemetry { .. }
    )
}
