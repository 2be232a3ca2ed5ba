//! Real-time priority and locked memory for the control loop of a real rig, where the system allows
//! them, as ros2_control asks for them.

use std::fmt;
use std::process::Command;

use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use nix::unistd::{geteuid, gettid};
use plumb_config::book::page;

/// Program of util-linux that sets the scheduling policy of a thread. This program has no code of
/// its own for it: the call needs `unsafe`.
const CHRT: &str = "chrt";

/// Priority under the policy SCHED_FIFO: below the 50 of the kernel's interrupt threads, which
/// serve the camera and the serial port.
const PRIORITY: &str = "40";

/// Result of the request. The text is for people.
#[derive(Debug)]
pub(crate) struct RealTime {
    /// Real-time priority, or why there is none.
    priority: Result<(), String>,
    /// Locked memory, or why it is not locked.
    memory: Result<(), String>,
}

impl RealTime {
    /// Asks for real-time priority for this thread, and locks the memory of the program. Threads
    /// that this one starts afterwards have the usual priority.
    pub(crate) fn ask() -> Self {
        Self { priority: set_priority(CHRT), memory: lock_memory() }
    }
}

impl fmt::Display for RealTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the control loop has ")?;
        match &self.priority {
            Ok(()) => f.write_str("real-time priority")?,
            Err(why) => write!(f, "no real-time priority ({why})")?,
        }
        match &self.memory {
            Ok(()) => f.write_str(", and its memory is locked")?,
            Err(why) => write!(f, ", and its memory is not locked ({why})")?,
        }
        if self.priority.is_ok() && self.memory.is_ok() {
            return Ok(());
        }
        write!(f, "; the run goes on. {}, \"Real time\", says how to allow it", page("running"))
    }
}

/// Sets the policy SCHED_FIFO for this thread with `program`, and the usual policy for the threads
/// that it starts (`-R`).
///
/// # Errors
/// The reason in words.
fn set_priority(program: &str) -> Result<(), String> {
    let thread = gettid().to_string();
    let mut command = Command::new(program);
    let output = command.args(["-f", "-R", "-p", PRIORITY, &thread]).env("LC_ALL", "C").output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("{program}: {}", text.lines().next().unwrap_or("it failed"))),
    }
}

/// Locks the present and later memory of the program.
///
/// # Errors
/// The reason in words. Where a limit holds nothing is locked: memory that is needed later could go
/// beyond it, and the run would end then.
fn lock_memory() -> Result<(), String> {
    let (limit, _) = getrlimit(Resource::RLIMIT_MEMLOCK).map_err(|errno| errno.to_string())?;
    if limit != RLIM_INFINITY && !geteuid().is_root() {
        return Err(format!("limit of {} kB", limit / 1024));
    }
    let flags = MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE;
    mlockall(flags).map_err(|errno| errno.desc().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_says_what_the_control_loop_has() {
        let real_time = RealTime { priority: Ok(()), memory: Ok(()) };
        let all = "the control loop has real-time priority, and its memory is locked";
        assert_eq!(real_time.to_string(), all);
        let no = |why: &str| Err(why.to_owned());
        let real_time = RealTime { priority: no("not permitted"), memory: no("limit of 8192 kB") };
        let none = format!(
            "the control loop has no real-time priority (not permitted), and its memory is not \
             locked (limit of 8192 kB); the run goes on. {}, \"Real time\", says how to allow it",
            page("running")
        );
        assert_eq!(real_time.to_string(), none);
    }

    #[test]
    fn a_program_that_fails_or_is_absent_is_the_reason() {
        assert_eq!(set_priority("true"), Ok(()));
        assert_eq!(set_priority("false"), Err("false: it failed".to_owned()));
        let absent = set_priority("/no-such-program").unwrap_err();
        assert!(absent.starts_with("/no-such-program: "), "{absent}");
    }
}
