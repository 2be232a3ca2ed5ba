//! Campaigns: runs over many seeds, with counts of what they exercised, and the violations found.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};

/// An invariant that was broken in a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// The run's seed.
    pub seed: u64,
    /// Index of the tick (or measurement, or frame) in the run, from 0.
    pub tick: u64,
    /// The invariant's name.
    pub invariant: &'static str,
    /// Observation.
    pub detail: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, tick, invariant, detail } = self;
        write!(f, "seed {seed} tick {tick}: {invariant}: {detail}")
    }
}

/// Counts of what was exercised, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally(BTreeMap<String, u64>);

impl Tally {
    /// Adds 1 to the count of `name`.
    pub fn count(&mut self, name: &str) {
        self.add(name, 1);
    }

    /// Adds `more` to the count of `name`.
    pub fn add(&mut self, name: &str, more: u64) {
        match self.0.get_mut(name) {
            Some(count) => *count += more,
            None => {
                self.0.insert(name.to_owned(), more);
            }
        }
    }

    /// Returns the count of `name`; 0 if it was never counted.
    pub fn of(&self, name: &str) -> u64 {
        self.0.get(name).copied().unwrap_or(0)
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts: Vec<String> =
            self.0.iter().map(|(name, count)| format!("{name} {count}")).collect();
        f.write_str(&counts.join(", "))
    }
}

/// Result of a run or of a campaign.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Counts of what was exercised.
    pub tally: Tally,
    /// Broken invariants, in the order of seeds and ticks.
    pub violations: Vec<Violation>,
    /// Seed of the current run.
    seed: u64,
    /// Tick of the current run.
    pub tick: u64,
}

impl Outcome {
    /// Returns the empty outcome of the run of `seed`.
    pub fn of(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }

    /// Records that `invariant` is broken, once for each run.
    pub fn broken(&mut self, invariant: &'static str, detail: impl FnOnce() -> String) {
        if self.violations.iter().all(|known| known.invariant != invariant) {
            let (seed, tick) = (self.seed, self.tick);
            self.violations.push(Violation { seed, tick, invariant, detail: detail() });
        }
    }

    /// Records that `invariant` is broken unless `holds`.
    pub fn check(&mut self, holds: bool, invariant: &'static str, detail: impl FnOnce() -> String) {
        if !holds {
            self.broken(invariant, detail);
        }
    }

    /// Checks that no invariant is broken.
    ///
    /// # Panics
    /// If one is broken, with the first violation of each.
    pub fn assert_unbroken(&self) {
        let broken: Vec<String> = self.summary().iter().map(ToString::to_string).collect();
        assert!(broken.is_empty(), "{}", broken.join("\n"));
    }

    /// Checks that each name was counted more than `minimum` times.
    ///
    /// # Panics
    /// If one was not.
    pub fn assert_exercised(&self, names: &[&str], minimum: u64) {
        for name in names {
            assert!(self.tally.of(name) > minimum, "{name} is too rare: {}", self.tally);
        }
    }

    /// Adds the outcome of other runs.
    fn merge(&mut self, other: Self) {
        for (name, count) in &other.tally.0 {
            self.tally.add(name, *count);
        }
        self.violations.extend(other.violations);
        self.violations.sort_by_key(|violation| (violation.seed, violation.tick));
    }

    /// Returns, for each broken invariant, the number of runs and the first violation.
    pub fn summary(&self) -> Vec<Broken<'_>> {
        let mut broken: BTreeMap<&str, Broken<'_>> = BTreeMap::new();
        for first in &self.violations {
            broken.entry(first.invariant).or_insert(Broken { runs: 0, first }).runs += 1;
        }
        broken.into_values().collect()
    }
}

/// A broken invariant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Broken<'a> {
    /// Number of runs in which it was broken.
    pub runs: u64,
    /// Its first violation.
    pub first: &'a Violation,
}

impl fmt::Display for Broken<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} runs; first: {})", self.first.invariant, self.runs, self.first)
    }
}

/// Nothing panics.
pub const NO_PANIC: &str = "no panic";

/// Runs `run` for each seed on `threads` threads. A panic ends its run and is a violation.
pub fn run(seeds: Range<u64>, threads: usize, run: impl Fn(u64, &mut Outcome) + Sync) -> Outcome {
    keep_panics();
    let next = AtomicU64::new(seeds.start);
    let work = || {
        let mut all = Outcome::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return all;
            }
            all.merge(guarded(seed, &run));
        }
    };
    let mut all = Outcome::default();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            match worker.join() {
                Ok(outcome) => all.merge(outcome),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
    });
    all
}

/// Runs one seed.
fn guarded(seed: u64, run: &(impl Fn(u64, &mut Outcome) + Sync)) -> Outcome {
    let mut outcome = Outcome::of(seed);
    if catch_unwind(AssertUnwindSafe(|| run(seed, &mut outcome))).is_err() {
        outcome.broken(NO_PANIC, || LAST_PANIC.take());
    }
    outcome
}

thread_local! {
    /// Message and location of this thread's last panic.
    static LAST_PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Stores the message of a panic, instead of printing it, on the threads of campaigns. They have no
/// name, unlike the threads of tests and the main thread.
fn keep_panics() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let default_hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if std::thread::current().name().is_some() {
                default_hook(panic);
            } else {
                LAST_PANIC.set(panic.to_string());
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_violation_with_seed_tick_and_cause() {
        let outcome = run(1..5, 2, |seed, outcome| {
            outcome.tally.count("run");
            outcome.tick = 7;
            assert!(seed != 3, "three is too many");
        });
        assert_eq!(outcome.tally.of("run"), 4);
        let [violation] = &outcome.violations[..] else { panic!("{:?}", outcome.violations) };
        assert_eq!((violation.seed, violation.tick, violation.invariant), (3, 7, NO_PANIC));
        assert!(violation.detail.contains("three is too many"), "{violation}");
    }

    #[test]
    fn an_invariant_is_recorded_once_for_each_run() {
        let outcome = run(0..3, 1, |_, outcome| {
            for tick in 0..4 {
                outcome.tick = tick;
                outcome.check(tick < 2, "fewer than two", || format!("{tick}"));
            }
        });
        assert_eq!(outcome.violations.iter().map(|v| v.tick).collect::<Vec<_>>(), [2; 3]);
        assert_eq!(outcome.summary()[0].runs, 3);
    }
}
