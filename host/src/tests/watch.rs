//! Watch over a start: its panics, in any thread, and its time of the processor.

use std::panic;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::thread;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// Longest time of the processor for a start, in its own thread. The slowest one, a path of ten
/// minutes that is checked twice, takes 0.8 s on a usual computer, and more on a busy one, whose
/// cores share their units.
const LONGEST: Duration = Duration::from_secs(8);

/// Time of the processor for the whole program, after which a start is taken to have no end. The
/// other tests of the program take far less.
const NO_END: Duration = Duration::from_secs(40);

/// Interval at which a start that goes on is looked at.
const INTERVAL: Duration = Duration::from_millis(100);

/// Messages of the panics since the last start.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Watch over starts, one after the other. Only one exists at a time: a panic belongs to the start
/// that goes on.
pub(super) struct Watch {
    _only: MutexGuard<'static, ()>,
    /// Longest time of the processor for a start.
    longest: Duration,
    problems: Vec<String>,
}

impl Watch {
    /// Begins to watch.
    pub(super) fn begin() -> Self {
        static ONLY: Mutex<()> = Mutex::new(());
        static HOOK: Once = Once::new();
        let only = ONLY.lock().unwrap_or_else(PoisonError::into_inner);
        HOOK.call_once(|| {
            let print = panic::take_hook();
            panic::set_hook(Box::new(move |info| {
                panics().push(info.to_string());
                print(info);
            }));
        });
        panics().clear();
        Self { _only: only, longest: LONGEST, problems: Vec::new() }
    }

    /// Runs `start` in a thread of its own. Returns its result; `None` where it panics.
    ///
    /// # Panics
    /// Where it goes on for longer than [`NO_END`]: nothing ends it.
    pub(super) fn start<T: Send + 'static>(
        &mut self,
        name: &str,
        start: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        let begin = time(ClockId::CLOCK_PROCESS_CPUTIME_ID);
        let (sender, receiver) = mpsc::channel();
        let thread = thread::spawn(move || {
            let result = start();
            // The receiver waits for it.
            let _sent = sender.send(time(ClockId::CLOCK_THREAD_CPUTIME_ID));
            result
        });
        let worked = loop {
            match receiver.recv_timeout(INTERVAL) {
                Ok(worked) => break worked,
                Err(RecvTimeoutError::Disconnected) => break Duration::ZERO,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let worked = time(ClockId::CLOCK_PROCESS_CPUTIME_ID).saturating_sub(begin);
            assert!(worked < NO_END, "{name}: no end; before: {:?}", self.problems);
        };
        let result = thread.join().ok();
        if worked > self.longest {
            self.problems.push(format!("{name}: {worked:?} of the processor"));
        }
        self.problems.extend(panics().drain(..).map(|panic| format!("{name}: {panic}")));
        result
    }

    /// Checks that no start had a problem.
    pub(super) fn end(self) {
        let Self { problems, .. } = self;
        assert!(problems.is_empty(), "{} problems:\n{}", problems.len(), problems.join("\n"));
    }
}

fn panics() -> MutexGuard<'static, Vec<String>> {
    PANICS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the time that the processor has worked for this thread or program.
#[allow(clippy::unwrap_used, reason = "Linux has both clocks")]
fn time(clock: ClockId) -> Duration {
    clock_gettime(clock).unwrap().into()
}

#[test]
fn a_panic_and_a_slow_start_are_problems() {
    let mut watch = Watch { longest: Duration::from_millis(100), ..Watch::begin() };
    assert_eq!(watch.start("quick", || 1), Some(1));
    assert!(watch.problems.is_empty());
    let lists: [Vec<u8>; 1] = [Vec::new()];
    assert_eq!(watch.start("wrong", move || lists[0][0]), None);
    let longest = watch.longest;
    watch.start("slow", move || {
        while time(ClockId::CLOCK_THREAD_CPUTIME_ID) <= longest {
            std::hint::spin_loop();
        }
    });
    let names: Vec<&str> = watch.problems.iter().filter_map(|it| it.get(..5)).collect();
    assert_eq!(names, ["wrong", "slow:"]);
}
