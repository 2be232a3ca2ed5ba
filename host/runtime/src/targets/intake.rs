//! Times of a sender's targets on the host's clock, and which of them count.

use std::fmt;

use plumb_cameras::error_chain::ErrorChain;
use plumb_timing::SenderClock;
use thiserror::Error;

use super::LeftOut;
use super::line::{LineMistake, TargetLine};

/// Greatest age of a target when it comes, seconds. An older one is left out.
pub const MAX_AGE_S: f64 = 0.5;

/// Difference of two time stamps above which a sender's clock was set, seconds.
const CLOCK_SET_S: f64 = 1.0;

/// Times of one sender's targets on the host's clock.
#[derive(Debug, Default)]
pub struct TargetClock {
    clock: SenderClock,
    /// Newest time stamp, seconds on the sender's clock.
    newest: Option<f64>,
}

/// Intake of the lines of one sender.
#[derive(Debug, Default)]
pub struct LineIntake {
    clock: TargetClock,
    /// Number of lines.
    lines: u64,
}

/// Reason why a target is left out.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{problem}")]
pub struct Omission {
    /// Reason, for people.
    pub problem: String,
    /// Kind of the reason.
    pub kind: OmissionKind,
}

/// Kind of a reason why a target is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OmissionKind {
    /// The line or message is not as documented.
    Unreadable,
    /// The target was told after a newer one.
    OutOfOrder,
    /// The target came too late, or its time is unknown.
    Late,
}

impl OmissionKind {
    /// Counts an omission.
    pub fn count(self, left_out: &mut LeftOut) {
        *match self {
            Self::Unreadable => &mut left_out.unreadable,
            Self::OutOfOrder => &mut left_out.out_of_order,
            Self::Late => &mut left_out.late,
        } += 1;
    }
}

impl Omission {
    fn new(problem: &dyn fmt::Display, kind: OmissionKind) -> Self {
        Self { problem: problem.to_string(), kind }
    }

    /// Returns the omission with the place of the target before its reason.
    fn at(self, place: &dyn fmt::Display) -> Self {
        Self { problem: format!("{place}: {}", self.problem), ..self }
    }
}

impl From<LineMistake> for Omission {
    fn from(mistake: LineMistake) -> Self {
        Self::new(&ErrorChain(&mistake), OmissionKind::Unreadable)
    }
}

impl TargetClock {
    /// Returns the time of a target on the host's clock, seconds. `t` is its time stamp on the
    /// sender's clock and `arrival` the arrival on the host's, both in seconds. Without a time
    /// stamp, the arrival is the time.
    ///
    /// # Errors
    /// Where the target is left out: it is not newer than the last one, late, or of unknown time.
    pub fn time(&mut self, t: Option<f64>, arrival: f64) -> Result<f64, Omission> {
        let Some(t) = t else { return Ok(arrival) };
        let behind = self.newest.map_or(-1.0, |newest| newest - t);
        if (0.0..=CLOCK_SET_S).contains(&behind) {
            let problem = format_args!("the time stamp is {behind:.3} s before the newest one");
            return Err(Omission::new(&problem, OmissionKind::OutOfOrder));
        }
        self.newest = Some(t);
        let late = OmissionKind::Late;
        let time = self.clock.taken(t, 0.0, arrival);
        let time = time.map_err(|error| Omission::new(&ErrorChain(&error), late))?;
        let age = arrival - time;
        if age > MAX_AGE_S {
            return Err(Omission::new(&format_args!("the target came {age:.3} s late"), late));
        }
        Ok(time)
    }
}

impl LineIntake {
    /// Takes in a line that came at `arrival` (seconds on the host's clock). Returns its target and
    /// the target's time on that clock; `None` for an empty line.
    ///
    /// # Errors
    /// Where the line is left out.
    pub fn take(
        &mut self,
        text: &str,
        arrival: f64,
    ) -> Result<Option<(TargetLine, f64)>, Omission> {
        self.lines += 1;
        if text.trim().is_empty() {
            return Ok(None);
        }
        let line = TargetLine::parse(text).map_err(|mistake| self.here(Omission::from(mistake)))?;
        let time = self.clock.time(line.t, arrival).map_err(|omission| self.here(omission))?;
        Ok(Some((line, time)))
    }

    /// Returns the omission of a line that cannot be read.
    pub(super) fn unreadable(&mut self, problem: &dyn fmt::Display) -> Omission {
        self.lines += 1;
        self.here(Omission::new(problem, OmissionKind::Unreadable))
    }

    /// Returns the number of lines.
    pub(super) fn lines(&self) -> u64 {
        self.lines
    }

    /// Returns the omission with the number of the last line.
    fn here(&self, omission: Omission) -> Omission {
        omission.at(&format_args!("line {}", self.lines))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes lines with these time stamps at these arrivals. Returns the times on the host's clock
    /// and what was left out.
    fn take(lines: &[(f64, f64)]) -> (Vec<f64>, LeftOut, Vec<String>) {
        let (mut intake, mut left_out) = (LineIntake::default(), LeftOut::default());
        let (mut times, mut problems) = (Vec::new(), Vec::new());
        for (t, arrival) in lines {
            let text = format!("{{\"t\": {t}, \"target\": [0.4, 0.3, 0.2]}}");
            match intake.take(&text, *arrival) {
                Ok(taken) => times.push(taken.unwrap().1),
                Err(omission) => {
                    omission.kind.count(&mut left_out);
                    problems.push(omission.problem);
                }
            }
        }
        (times, left_out, problems)
    }

    #[test]
    fn lines_out_of_order_are_left_out_until_a_newer_one_comes() {
        let (times, left_out, problems) = take(&[
            (100.0, 1.0),
            (100.2, 1.2),
            (100.1, 1.21),
            (100.2, 1.22),
            (100.15, 1.23),
            (100.3, 1.3),
        ]);
        assert_eq!(times.len(), 3, "{times:?}");
        assert!((times[2] - 1.3).abs() < 1e-6, "{times:?}");
        assert_eq!(left_out, LeftOut { out_of_order: 3, ..LeftOut::default() });
        assert_eq!(problems[0], "line 3: the time stamp is 0.100 s before the newest one");
    }

    #[test]
    fn late_lines_are_left_out_and_less_late_ones_keep_their_time() {
        let (times, left_out, problems) =
            take(&[(5.0, 1.0), (5.1, 1.3), (5.2, 1.8), (5.3, 1.9), (5.9, 1.9)]);
        // 0.2 s late.
        assert!((times[1] - 1.1).abs() < 1e-3, "{times:?}");
        assert_eq!((times.len(), left_out.late), (3, 2), "{problems:?}");
        assert_eq!(problems[0], "line 3: the target came 0.600 s late");
    }

    #[test]
    fn a_clock_that_was_set_is_followed_after_one_line() {
        let (times, left_out, _) = take(&[(5.0, 1.0), (5.1, 1.1), (0.1, 1.2), (0.2, 1.3)]);
        assert_eq!((times.len(), left_out.late), (3, 1));
        assert!((times[2] - 1.3).abs() < 1e-6, "{times:?}");
    }

    #[test]
    fn without_a_time_stamp_the_arrival_counts_and_empty_lines_are_nothing() {
        let mut intake = LineIntake::default();
        assert_eq!(intake.take(" \n", 1.0), Ok(None));
        let taken = intake.take("{\"target\": [0.4, 0.3, 0.2]}\n", 2.5).unwrap();
        assert_eq!(taken.unwrap().1, 2.5);
        let omission = intake.take("{\"target\": 1}", 3.0).unwrap_err();
        assert!(omission.problem.starts_with("line 3: no target: "), "{omission:?}");
    }
}
