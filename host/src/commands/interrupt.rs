//! Signals that end a run, and one that does not.

use std::ffi::c_int;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use super::Failure;

/// Whether a signal ends the program at once.
static ENDS_AT_ONCE: AtomicBool = AtomicBool::new(false);

/// Time in which a further signal belongs to the first one. `timeout` sends SIGTERM twice, and a
/// terminal that closes sends SIGHUP together with its shell.
const ONE_REQUEST: Duration = Duration::from_millis(200);

/// Has a write beyond the limit of a file's size (`ulimit -f`) fail, as one on a full disk does:
/// without a handler its signal ends the program.
///
/// # Errors
/// Where the operating system takes no handler.
pub(crate) fn outlive_file_size_limit() -> io::Result<()> {
    // Nobody reads the flag: the error of the write says enough.
    flag::register(SIGXFSZ, Arc::default()).map(drop)
}

/// Returns a flag that Ctrl-C, SIGTERM and SIGHUP set, so that the motors are ramped down and the
/// run's folder is finished. A second signal, after [`ONE_REQUEST`], ends the program at once; a
/// board without a host stops by itself.
///
/// A SIGHUP that was ignored when the program began (`nohup`) stays ignored.
pub(crate) fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let handled = [SIGINT, SIGTERM, SIGHUP]
        .into_iter()
        .filter(|&signal| signal != SIGHUP || !ignores(&status, signal));
    let signals = Signals::new(handled)?;
    let shared = Arc::clone(&flag);
    thread::Builder::new().name("signals".to_owned()).spawn(move || handle(signals, &shared))?;
    Ok(flag)
}

/// Sets `flag` at the first signal. Ends the program at the second, or while a
/// [`DefaultSignals`] exists.
fn handle(mut signals: Signals, flag: &AtomicBool) {
    let mut first: Option<Instant> = None;
    for signal in signals.forever() {
        let repeated = first.get_or_insert_with(Instant::now).elapsed() > ONE_REQUEST;
        if repeated || ENDS_AT_ONCE.load(Ordering::Relaxed) {
            // The handled signals all have a default that ends the program.
            let _unknown_signal = emulate_default_handler(signal);
        }
        flag.store(true, Ordering::Relaxed);
    }
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
