//! Signals that end a run.

use std::ffi::c_int;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_default};

use super::Failure;

/// Whether a signal ends the program at once.
static ENDS_AT_ONCE: AtomicBool = AtomicBool::new(false);

/// Returns a flag that Ctrl-C, SIGTERM and SIGHUP set, so that the motors are ramped down and the
/// run's folder is finished.
///
/// A SIGHUP that was ignored when the program began (`nohup`) stays ignored.
pub(crate) fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        if signal != SIGHUP || !ignores(&status, signal) {
            register_conditional_default(signal, &ENDS_AT_ONCE)?;
            register(signal, Arc::clone(&flag))?;
        }
    }
    Ok(flag)
}

/// Time in which a signal ends the program at once: the motors stand, the files are closed, and
/// the terminal may be stopped (Ctrl-S).
pub(super) struct DefaultSignals(());

impl DefaultSignals {
    /// Begins the time, which lasts until the value is dropped.
    pub(super) fn begin() -> Self {
        ENDS_AT_ONCE.store(true, Ordering::Relaxed);
        Self(())
    }
}

impl Drop for DefaultSignals {
    fn drop(&mut self) {
        ENDS_AT_ONCE.store(false, Ordering::Relaxed);
    }
}

/// Whether a process ignores `signal`, by the text of its `/proc/PID/status`. Where there is none
/// it ignores nothing.
fn ignores(status: &str, signal: c_int) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (signal - 1)) != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_ignored_is_read_from_the_mask() {
        let status =
            "Name:\tplumb\nSigBlk:\t0000000000000001\nSigIgn:\t0000000000001002\nSigCgt:\t0\n";
        let ignored =
            [SIGHUP, SIGINT, signal_hook::consts::SIGPIPE].map(|signal| ignores(status, signal));
        assert_eq!(ignored, [false, true, true]);
        assert!(!ignores("", SIGHUP));
    }
}
