//! Report of a run.

use crate::cause::Cause;
use crate::plan::Plan;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The system stopped, and this cause was reported.
    Stopped(Cause),
    /// The board stopped for this cause, and the next life of the host reached its targets.
    Recovered(Cause),
    /// The run went on and reached targets after the fault.
    WentOn,
    /// Neither.
    Undecided,
}

/// What a run showed.
#[derive(Debug, Clone)]
pub struct Report {
    /// What the seed decided.
    pub plan: Plan,
    /// How it ended.
    pub end: End,
    /// Time from the onset to the first reaction, s: the board's fault or the end of the run.
    pub detected_s: Option<f64>,
    /// Time from the reaction to the last turn of a motor, s.
    pub stop_s: Option<f64>,
    /// Farthest that the ball was from where it was at the onset, until the motors stood, m.
    pub moved_m: f64,
    /// Largest growth of the ball's distance from its target above the smallest, until the motors
    /// stood, m.
    pub away_m: f64,
    /// Broken invariants.
    pub violations: Vec<String>,
}

impl Report {
    /// Returns the names of the faults.
    pub fn faults(&self) -> String {
        let names: Vec<&str> = self.plan.faults.iter().map(|f| f.kind.traits().name).collect();
        names.join(" and ")
    }

    /// Returns whether no invariant is broken and the end is decided.
    pub fn is_good(&self) -> bool {
        self.violations.is_empty() && self.end != End::Undecided
    }

    /// Returns the command that repeats the run.
    pub fn command(&self) -> String {
        let (runs, others) =
            if self.plan.is_short { ("--chip-runs", "--runs") } else { ("--runs", "--chip-runs") };
        let arguments = format!("--first-seed {} {runs} 1 {others} 0 --verbose", self.plan.seed);
        format!("cargo run --release -p plumb-faults -- {arguments}")
    }
}
