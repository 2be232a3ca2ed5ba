//! Many inputs of a target, with the crashes that they cause.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use crate::generator::Generator;
use crate::target::Target;

/// An input that made the target panic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crash {
    /// Number of the execution, from 1. The inputs of the corpus are the first.
    pub execution: u64,
    /// The input.
    pub input: Vec<u8>,
}

/// Result of a campaign.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// Calls of the target.
    pub executions: u64,
    /// Bytes of all inputs.
    pub bytes: u64,
    /// Longest call.
    pub slowest: Duration,
    /// Crashes, the first [`MAX_CRASHES`].
    pub crashes: Vec<Crash>,
}

/// Most crashes that are kept. The campaign of a target ends with the last.
pub const MAX_CRASHES: usize = 10;

/// Calls `target` with every input of `corpus`, then with changed ones while `goes_on` returns
/// `true` for the number of executions so far.
pub fn run(
    target: &Target,
    corpus: &[Vec<u8>],
    seed: u64,
    mut goes_on: impl FnMut(u64) -> bool,
) -> Report {
    let mut report = Report::default();
    for input in corpus {
        report.execute(target, input);
    }
    let mut generator = Generator::new(seed, target, corpus);
    let mut input = Vec::new();
    while goes_on(report.executions) && report.crashes.len() < MAX_CRASHES {
        generator.next(&mut input);
        report.execute(target, &input);
    }
    report
}

impl Report {
    fn execute(&mut self, target: &Target, input: &[u8]) {
        self.executions += 1;
        self.bytes += input.len() as u64;
        let begin = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
        self.slowest = self.slowest.max(begin.elapsed());
        if result.is_err() {
            self.crashes.push(Crash { execution: self.executions, input: input.to_vec() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAGILE: Target = Target {
        name: "fragile",
        input: "bytes without a 7 at their beginning",
        run: |input| assert!(input.first() != Some(&7), "a 7"),
        max_length: 10,
        smoke: 0,
        words: &[],
    };

    #[test]
    fn a_crash_is_kept_with_its_input() {
        let report = run(&FRAGILE, &[vec![1, 2], vec![7, 8]], 1, |executions| executions < 2);
        assert_eq!((report.executions, report.bytes), (2, 4));
        assert_eq!(report.crashes, [Crash { execution: 2, input: vec![7, 8] }]);
    }

    #[test]
    fn the_generator_finds_a_crash_next_to_the_corpus() {
        let report = run(&FRAGILE, &[vec![6, 2]], 1, |executions| executions < 100_000);
        assert_eq!(report.crashes.len(), MAX_CRASHES);
        assert!(report.crashes.iter().all(|crash| crash.input[0] == 7));
    }
}
