//! Times of a sender's targets on the host's clock, and which of them count.

use std::collections::VecDeque;
use std::error::Error;
use std::fmt;

use plumb_config::error_chain::ErrorChain;
use plumb_frame::clock::SenderClock;
use thiserror::Error;

use super::line::{LineMistake, TargetLine};
use super::source::LeftOut;

/// Greatest age of a target when it comes, seconds. An older one is left out.
pub const MAX_AGE_S: f64 = 0.5;

/// Difference of two time stamps above which a sender's clock was set, seconds.
const CLOCK_SET_S: f64 = 1.0;

/// Least step of a sender's clock that is looked for, seconds.
const LEAST_STEP_S: f64 = 0.05;

/// Number of lines and their time, seconds, after which a step of a sender's clock stays.
const STEP_LINES: usize = 10;
const STEP_S: f64 = 0.3;

/// Largest difference between the least delays of the two halves of these lines, seconds. Lines
/// that were held up make up for their delay, and a growing delay grows on.
const STEP_SPREAD_S: f64 = 0.03;

/// Times of one sender's targets on the host's clock.
#[derive(Debug, Default)]
pub struct TargetClock {
    clock: SenderClock,
    /// Newest time stamp, seconds on the sender's clock.
    newest: Option<f64>,
    /// Delay of the last line before the step, seconds.
    before: Option<f64>,
    /// The last lines in a row since the sender's clock seems to have been set back.
    step: VecDeque<Stamp>,
}

/// Time stamp of a line.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    /// Seconds on the sender's clock.
    t: f64,
    /// Arrival on the host's clock minus time stamp, seconds.
    delay: f64,
}

/// Length up to which the rest of a line that is too long is skipped, bytes.
pub(super) const MAX_SKIPPED_BYTES: usize = 1 << 20;

/// Unreadable lines in a row, or lines of unknown time, that end a sender.
const MAX_UNUSABLE: u32 = 10;

/// What a sender may begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Beginning {
    /// Lines that are no targets are left out, however many come before the first target:
    /// standard input may begin with a banner.
    #[default]
    Banner,
    /// The first line must be a target: a browser, which can reach a socket, cannot send one before
    /// its request or its handshake.
    Target,
}

/// Intake of the lines of one sender.
#[derive(Debug, Default)]
pub struct LineIntake {
    clock: TargetClock,
    beginning: Beginning,
    /// Number of lines.
    lines: u64,
    /// Whether one of the lines was a target.
    has_target: bool,
    /// Number of unreadable lines since the last target.
    unreadable: u32,
    /// Number of lines of unknown time since the last one whose time is known.
    untimed: u32,
}

/// Reason to end a sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SenderFault {
    /// Its first line is no target.
    #[error("its first line is no target (is it a browser or another program?)")]
    FirstLine,
    /// After a target, as many lines in a row are unreadable as end a sender.
    #[error("ten unreadable lines in a row")]
    Unreadable,
    /// As many lines in a row have no time as end a sender.
    #[error("the times of ten lines in a row do not fit this computer's clock (`t` is in seconds)")]
    Untimed,
    /// A line is so long that its end is not awaited.
    #[error("a line without an end within {MAX_SKIPPED_BYTES} bytes")]
    Endless,
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
    /// The target came too late.
    Late,
    /// Its time is unknown: the sender's clock does not run evenly.
    Untimed,
}

impl OmissionKind {
    /// Counts an omission.
    pub fn count(self, left_out: &mut LeftOut) {
        *match self {
            Self::Unreadable => &mut left_out.unreadable,
            Self::OutOfOrder => &mut left_out.out_of_order,
            Self::Late | Self::Untimed => &mut left_out.late,
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
    /// stamp, the arrival is the time. A clock that was set back, and a delay that has grown at
    /// once, count after ten lines.
    ///
    /// # Errors
    /// Where the target is left out: it is not newer than the last one, late, or of unknown time.
    pub fn time(&mut self, t: Option<f64>, arrival: f64) -> Result<f64, Omission> {
        let Some(t) = t else { return Ok(arrival) };
        let time = self.mapped(t, arrival);
        if !self.has_stepped(Stamp { t, delay: arrival - t }, time.is_err()) {
            return time;
        }
        *self = Self::default();
        self.mapped(t, arrival)
    }

    /// Returns the time by the mapping so far, as [`time`](Self::time).
    fn mapped(&mut self, t: f64, arrival: f64) -> Result<f64, Omission> {
        let behind = self.newest.map_or(-1.0, |newest| newest - t);
        if (0.0..=CLOCK_SET_S).contains(&behind) {
            let problem = format_args!("the time stamp is {behind:.3} s before the newest one");
            return Err(Omission::new(&problem, OmissionKind::OutOfOrder));
        }
        self.newest = Some(t);
        let time = self.clock.taken(t, 0.0, arrival);
        let time =
            time.map_err(|error| Omission::new(&ErrorChain(&error), OmissionKind::Untimed))?;
        let age = arrival - time;
        if age > MAX_AGE_S {
            let problem = format_args!("the target came {age:.3} s late");
            return Err(Omission::new(&problem, OmissionKind::Late));
        }
        Ok(time)
    }

    /// Notes a line, which is left out or counts. Returns whether the sender's clock was set back
    /// some lines ago, and has stayed so. A delay that grows from line to line is none.
    fn has_stepped(&mut self, line: Stamp, is_left_out: bool) -> bool {
        let before = *self.before.get_or_insert(line.delay);
        let middle = |last: &Stamp| 0.5 * (last.delay + before);
        if self.step.back().is_some_and(|last| line.t <= last.t || line.delay < middle(last)) {
            self.step.clear();
        }
        let begins = is_left_out && line.delay - before > LEAST_STEP_S;
        if self.step.is_empty() && !begins {
            self.before = Some(line.delay);
            return false;
        }
        self.step.push_back(line);
        while self.step.len() > STEP_LINES && line.t - self.step[1].t >= STEP_S {
            self.step.pop_front();
        }
        let least = |lines: &[Stamp]| lines.iter().map(|it| it.delay).fold(f64::MAX, f64::min);
        let lines = self.step.make_contiguous();
        let (first, last) = lines.split_at(lines.len() / 2);
        let (spread, span) = (least(first) - least(last), line.t - lines[0].t);
        lines.len() >= STEP_LINES && span >= STEP_S && spread.abs() <= STEP_SPREAD_S
    }
}

impl LineIntake {
    /// Returns the intake of a sender that may begin with this.
    pub fn new(beginning: Beginning) -> Self {
        Self { beginning, ..Self::default() }
    }

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
        if text.trim().is_empty() && (self.beginning == Beginning::Banner || self.lines > 0) {
            self.lines += 1;
            return Ok(None);
        }
        let line = TargetLine::parse(text).map_err(|mistake| self.unreadable(&mistake))?;
        self.lines += 1;
        (self.has_target, self.unreadable) = (true, 0);
        let time = self.clock.time(line.t, arrival);
        let is_untimed = matches!(&time, Err(omission) if omission.kind == OmissionKind::Untimed);
        self.untimed = if is_untimed { self.untimed.saturating_add(1) } else { 0 };
        let time = time.map_err(|omission| self.here(omission))?;
        Ok(Some((line, time)))
    }

    /// Returns the omission of a line that cannot be read, because of `error`.
    pub(super) fn unreadable(&mut self, error: &(dyn Error + 'static)) -> Omission {
        self.lines += 1;
        self.unreadable = self.unreadable.saturating_add(1);
        self.here(Omission::new(&ErrorChain(error), OmissionKind::Unreadable))
    }

    /// Returns why the sender must be ended after the lines that it has sent; `None` where it may
    /// go on.
    pub fn fault(&self) -> Option<SenderFault> {
        match self.beginning {
            Beginning::Target if self.lines > 0 && !self.has_target => Some(SenderFault::FirstLine),
            _ if self.has_target && self.unreadable >= MAX_UNUSABLE => {
                Some(SenderFault::Unreadable)
            }
            _ if self.untimed >= MAX_UNUSABLE => Some(SenderFault::Untimed),
            _ => None,
        }
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

    /// Takes lines until the sender is ended. Returns the number of targets, and why it is ended.
    fn take_until_fault(beginning: Beginning, lines: &[&str]) -> (usize, Option<SenderFault>) {
        let mut intake = LineIntake::new(beginning);
        let mut targets = 0;
        for text in lines {
            targets += usize::from(matches!(intake.take(text, 0.0), Ok(Some(_))));
            if intake.fault().is_some() {
                break;
            }
        }
        (targets, intake.fault())
    }

    #[test]
    fn a_banner_may_come_first_on_standard_input_only() {
        let (good, bad) = ("{\"target\": [0.4, 0.3, 0.2]}", "tracker 1.7");
        for banner in [&[bad][..], &[""], &["", bad, bad], &[bad; 50]] {
            let lines = [banner, &[good, good]].concat();
            assert_eq!(take_until_fault(Beginning::Banner, &lines), (2, None), "{banner:?}");
            let fault = Some(SenderFault::FirstLine);
            assert_eq!(take_until_fault(Beginning::Target, &lines), (0, fault), "{banner:?}");
        }
        // After the first target they are alike.
        for beginning in [Beginning::Banner, Beginning::Target] {
            let nine = [&[good][..], &[bad; 9], &["", good], &[bad; 9], &[good]].concat();
            assert_eq!(take_until_fault(beginning, &nine), (3, None));
            let ten = [&[good][..], &[bad; 5], &[""], &[bad; 5], &[good]].concat();
            assert_eq!(take_until_fault(beginning, &ten), (1, Some(SenderFault::Unreadable)));
        }
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

    /// As of a program that writes milliseconds, 30 lines a second.
    #[test]
    fn a_sender_whose_times_are_milliseconds_is_ended() {
        let mut intake = LineIntake::default();
        let line = |k: f64| format!("{{\"t\": {}, \"target\": [0.4, 0.3, 0.2]}}", 33.0 * k);
        let taken = (0..11).map(f64::from).map(|k| {
            assert_eq!(intake.fault(), None, "line {k}");
            intake.take(&line(k), 0.033 * k)
        });
        let taken: Vec<_> = taken.collect();
        assert!(taken[0].is_ok());
        for omission in taken.into_iter().skip(1) {
            let problem = omission.unwrap_err().problem;
            assert!(problem.contains("+32.967 s against"), "{problem}");
            assert!(problem.contains("`t` is not in seconds"), "{problem}");
        }
        assert_eq!(intake.fault(), Some(SenderFault::Untimed));
    }

    #[test]
    fn a_clock_that_was_set_is_followed_after_one_line() {
        let (times, left_out, _) = take(&[(5.0, 1.0), (5.1, 1.1), (0.1, 1.2), (0.2, 1.3)]);
        assert_eq!((times.len(), left_out.late), (3, 1));
        assert!((times[2] - 1.3).abs() < 1e-6, "{times:?}");
    }

    /// Takes 30 lines a second for 20 s, with these time stamps and delays at a time, seconds.
    /// Returns the largest error of the times from 14 s on, seconds, and what was left out.
    fn times_after(t: impl Fn(f64) -> f64, delay: impl Fn(f64) -> f64) -> (f64, LeftOut) {
        let (mut clock, mut left_out, mut worst) =
            (TargetClock::default(), LeftOut::default(), 0.0_f64);
        for at in (0..600).map(|k| f64::from(k) / 30.0) {
            match clock.time(Some(t(at)), at + delay(at)) {
                Ok(time) if at > 14.0 => worst = worst.max((time - at).abs()),
                Ok(_) => {}
                Err(omission) => omission.kind.count(&mut left_out),
            }
        }
        (worst, left_out)
    }

    /// Delays up to 15 ms.
    fn network(at: f64) -> f64 {
        0.015 * (7.0 * at).sin().abs()
    }

    #[test]
    fn a_clock_that_is_set_back_is_followed_after_some_lines() {
        for step in [0.1, 0.3, 0.6, 0.9, 1.5, 40.0, -0.6, -3.0] {
            let set = |at| if at < 12.0 { 70.0 + at } else { 70.0 + at - step };
            let (worst, left_out) = times_after(set, network);
            assert!(worst < 0.02, "{step} s: {worst} s");
            let LeftOut { out_of_order, late, .. } = left_out;
            assert!(out_of_order + late <= 10, "{step} s: {left_out:?}");
        }
        // Two lines a second do not come before the newest one.
        let lines: Vec<_> = (0..40).map(|k| 0.5 * f64::from(k)).collect();
        let set = |at: &f64| (if *at < 12.0 { *at } else { at - 0.6 } + 70.0, *at);
        let (times, left_out, _) = take(&lines.iter().map(set).collect::<Vec<_>>());
        assert_eq!((left_out.out_of_order + left_out.late, times.last()), (9, Some(&19.5)));
    }

    #[test]
    fn lines_that_are_later_and_later_or_late_for_a_while_are_no_step_of_a_clock() {
        // Senders that count 30 lines a second and send 29, or 27; now and then a line is late.
        let rough = |at: f64| if (30.0 * at).round() % 20.0 == 7.0 { 0.07 } else { network(at) };
        for rate in [29.0 / 30.0, 0.9] {
            for delay in [&network as &dyn Fn(f64) -> f64, &rough] {
                let (_, left_out) = times_after(|at| rate * at, delay);
                assert!(left_out.late > 300, "{rate}: {left_out:?}");
            }
        }
        // Every other line comes from a program that is 0.2 s behind.
        let two = |at: f64| if (at * 30.0).round() % 2.0 == 0.0 { 0.0 } else { 0.2 };
        let (worst, left_out) = times_after(|at| at - two(at), network);
        assert!(worst < 0.02 && left_out.out_of_order > 280, "{worst}: {left_out:?}");
        // All lines of 2 s come at once.
        let held = |at: f64| if (10.0..12.0).contains(&at) { 12.0 - at } else { network(at) };
        let (worst, left_out) = times_after(|at| at, held);
        assert!(worst < 0.02 && (40..=50).contains(&left_out.late), "{worst}: {left_out:?}");
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
