//! Signals that end a run, and one that does not.

use std::ffi::c_int;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use crate::cli::exit::{Failure, failed};
use crate::cli::print::{is_quiet, tell_above};

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
/// board without a host stops by itself. Both are reported where the command `moves` something.
///
/// A SIGHUP that was ignored when the program began (`nohup`) stays ignored.
pub(crate) fn interrupt_flag(moves: bool) -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let handled = [SIGINT, SIGTERM, SIGHUP]
        .into_iter()
        .filter(|&signal| signal != SIGHUP || !ignores(&status, signal));
    let signals = Signals::new(handled)?;
    let shared = Arc::clone(&flag);
    thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || handle(signals, &shared, moves))?;
    Ok(flag)
}

/// Returns the failure of a `run` or `check` that a signal ended before its first motion.
pub(crate) fn interrupted_before(work: &str) -> Failure {
    failed(format!("interrupted before the {work} began: nothing was moved"))
}

/// Sets `flag` at the first signal. Ends the program at the second, or while a
/// [`DefaultSignals`] exists.
fn handle(mut signals: Signals, flag: &AtomicBool, moves: bool) {
    let mut first: Option<Instant> = None;
    for signal in signals.forever() {
        let repeated = first.get_or_insert_with(Instant::now).elapsed() > ONE_REQUEST;
        let ends_at_once = ENDS_AT_ONCE.load(Ordering::Relaxed);
        if repeated || ends_at_once {
            if moves && !ends_at_once {
                let _too_slow = report(AT_ONCE.to_owned()).recv_timeout(REPORT_TIMEOUT);
            }
            // The handled signals all have a default that ends the program.
            let _unknown_signal = emulate_default_handler(signal);
        }
        // The stop comes before the message.
        let is_first = !flag.swap(true, Ordering::Relaxed);
        if moves && is_first && !is_quiet() {
            // Whether something moves already is not known here.
            report("stopping; Ctrl-C again ends the program at once".to_owned());
        }
    }
}

/// Message of a second signal.
const AT_ONCE: &str = "ended at once: the board stops by itself after `deadlines.host`; `plumb \
                       board status` says whether the motors stand";

/// Longest time that a message takes from the end of the program.
const REPORT_TIMEOUT: Duration = Duration::from_millis(50);

/// Prints a line in a thread of its own: a terminal that is stopped (Ctrl-S) delays no signal. The
/// receiver gets a message, or its end, once the line is printed.
fn report(line: String) -> Receiver<()> {
    let (done, printed) = channel();
    let print = move || {
        // In place of a progress line, and of the ^C of the terminal.
        tell_above(format_args!("{line}"));
        let _nobody_waits = done.send(());
    };
    // Without a thread there is no message.
    let _no_thread = thread::Builder::new().name("interrupt".to_owned()).spawn(print);
    printed
}

/// Time in which a signal ends the program at once: the motors stand, the files are closed, and
/// the terminal may be stopped (Ctrl-S).
pub(crate) struct DefaultSignals(());

impl DefaultSignals {
    /// Begins the time, which lasts until the value is dropped.
    pub(crate) fn begin() -> Self {
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
