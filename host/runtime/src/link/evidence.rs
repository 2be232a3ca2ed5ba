//! What the link counts in order to tell the cause of a fault.

use std::collections::VecDeque;
use std::time::Duration;

use plumb_protocol::config::{Config, Workspace};
use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micrometres, Point};

use super::error::Damage;
use super::timing::KEEP_ALIVE;
use crate::board_fault::{BoardFault, FaultCause};
use crate::wakeups::LateWakeups;

/// Time for which counts are kept: one and a half times the longest deadline that a rig may have.
const KEPT: Duration = Duration::from_millis(7500);

/// Time over which damaged frames are counted for an error of the link: the longest wait for an
/// answer, and a telemetry that reports it.
const DAMAGE_WINDOW: Duration = Duration::from_secs(2);

/// Time between two messages to the board above which this program woke late: three times the
/// longest that a program in time leaves.
pub const LATE: Duration = KEEP_ALIVE.saturating_mul(3);

/// Least share of damaged frames that explains a fault: one in this number.
const DAMAGED_ONE_IN: u32 = 4;

/// Counts of the last seconds, with their times.
#[derive(Debug, Default)]
pub(super) struct Evidence {
    /// When the last message was sent.
    last_tx: Duration,
    sent: Recent,
    damaged_to_board: Recent,
    damaged_to_host: Recent,
    /// The board's count of damaged frames in its last telemetry.
    board_count: Option<u16>,
    /// Late wake-ups, by the time without a message, ms.
    late: Recent,
    /// All late wake-ups since `counted_from`.
    late_wakeups: LateWakeups,
    /// Start of the count of late wake-ups.
    counted_from: Duration,
    /// Positions that the board refused for their age.
    old: Recent,
    /// Ages with which positions were sent, ms.
    ages: Recent,
    /// Last place of the ball that was sent.
    ball: Option<Point>,
}

impl Evidence {
    /// Notes that a message is sent at `now`.
    pub(super) fn sent(&mut self, now: Duration) {
        let silence = self.counted_silence(now);
        if silence > LATE {
            self.late.add(now, milliseconds(silence));
            self.late_wakeups.add(silence);
        }
        self.last_tx = now;
        self.sent.add(now, 1);
    }

    /// Begins to count late wake-ups at `now`: what was before, such as the preparation of the
    /// detector, explains no fault.
    pub(super) fn count_late_wakeups(&mut self, now: Duration) {
        (self.late, self.late_wakeups, self.counted_from) =
            (Recent::default(), LateWakeups::default(), now);
    }

    /// Returns the late wake-ups since the count began; `None` where there was none.
    pub(super) fn late_wakeups(&self) -> Option<LateWakeups> {
        (self.late_wakeups.times > 0).then_some(self.late_wakeups)
    }

    /// Returns the time since the last message was sent.
    pub(super) fn silence(&self, now: Duration) -> Duration {
        now.saturating_sub(self.last_tx)
    }

    /// Returns the time since the last message was sent, or since the count of late wake-ups began.
    fn counted_silence(&self, now: Duration) -> Duration {
        self.silence(now).min(now.saturating_sub(self.counted_from))
    }

    /// Notes that a position is sent, of a frame taken `age` ago with the ball at this place.
    pub(super) fn position(&mut self, age: Duration, ball: Option<Point>, now: Duration) {
        self.ages.add(now, milliseconds(age));
        self.ball = ball.or(self.ball);
    }

    /// Notes that the board refused a position for its age.
    pub(super) fn old_position(&mut self, now: Duration) {
        self.old.add(now, 1);
    }

    /// Notes the board's count of damaged frames since its start; saturating.
    pub(super) fn board_count(&mut self, count: u16, now: Duration) {
        let before = self.board_count.replace(count).unwrap_or(count);
        self.damaged_to_board.add(now, count.saturating_sub(before).into());
    }

    /// Notes a damaged frame from the board.
    pub(super) fn damaged(&mut self, now: Duration) {
        self.damaged_to_host.add(now, 1);
    }

    /// Returns the frames that were damaged on the wire lately.
    pub(super) fn damage(&self, now: Duration) -> Damage {
        let from = now.saturating_sub(DAMAGE_WINDOW);
        let to_board = self.damaged_to_board.since(from).sum();
        Damage { to_board, to_host: self.damaged_to_host.since(from).sum() }
    }

    /// Returns the fault that is known at `now`, with its cause where the counts show one. They are
    /// those of one and a half times the deadline that has passed.
    pub(super) fn explain(&self, fault: Fault, config: &Config, now: Duration) -> BoardFault {
        let deadline = match fault {
            Fault::HostSilent => config.deadlines.host,
            Fault::PositionLost => config.deadlines.position,
            Fault::BallOutside => {
                return BoardFault { fault, cause: self.outside(&config.workspace) };
            }
            _ => return fault.into(),
        };
        let deadline = Duration::from_millis(deadline.0.into());
        let from = now.saturating_sub(deadline * 3 / 2);
        let cause = match fault {
            // A message may have been on its way when the silence began.
            Fault::HostSilent => self.late_host(deadline * 3 / 4, from, now),
            // A position may have come before and after the silence, with an age of its own.
            _ => self.late_host(deadline * 2 / 5, from, now).or_else(|| self.old_positions(from)),
        };
        BoardFault { fault, cause: cause.or_else(|| self.damaged_frames(from)) }
    }

    /// Returns the late wake-ups, if this program was silent for at least `least`.
    fn late_host(&self, least: Duration, from: Duration, now: Duration) -> Option<FaultCause> {
        let present = self.counted_silence(now);
        let late = self.late.since(from).map(|ms| Duration::from_millis(ms.into()));
        let silences = || late.clone().chain((present > LATE).then_some(present));
        let longest = silences().max()?;
        let times = silences().count() as u32;
        (longest >= least).then_some(FaultCause::LateHost { times, longest })
    }

    /// Returns where the ball is outside the workspace, on the axis on which it is farthest.
    fn outside(&self, workspace: &Workspace) -> Option<FaultCause> {
        let ball = self.ball?;
        let axes = ['x', 'y', 'z'].into_iter().zip(ball.0);
        let borders = workspace.min.0.into_iter().zip(workspace.max.0);
        let outside = axes.zip(borders).map(|((axis, at), (min, max))| {
            let border = Micrometres(at.0.clamp(min.0, max.0));
            FaultCause::Outside { axis, at, border }
        });
        let distance = |cause: &FaultCause| match cause {
            FaultCause::Outside { at, border, .. } => at.0.abs_diff(border.0),
            _ => 0,
        };
        outside.max_by_key(distance).filter(|cause| distance(cause) > 0)
    }

    fn damaged_frames(&self, from: Duration) -> Option<FaultCause> {
        let damaged = self.damaged_to_board.since(from).sum();
        let sent = self.sent.since(from).sum();
        let explains = damaged > 0 && damaged >= sent / DAMAGED_ONE_IN;
        explains.then_some(FaultCause::DamagedFrames { damaged, sent })
    }

    fn old_positions(&self, from: Duration) -> Option<FaultCause> {
        let old: u32 = self.old.since(from).sum();
        let oldest = Duration::from_millis(self.ages.since(from).max()?.into());
        let explains = old > 0 && old as usize >= self.ages.since(from).count() / 2;
        explains.then_some(FaultCause::OldPositions { old, oldest })
    }
}

/// Numbers with their times.
#[derive(Debug, Default)]
struct Recent(VecDeque<(Duration, u32)>);

impl Recent {
    /// Adds a number above 0.
    fn add(&mut self, now: Duration, number: u32) {
        if number > 0 {
            while self.0.front().is_some_and(|(at, _)| *at + KEPT < now) {
                self.0.pop_front();
            }
            self.0.push_back((now, number));
        }
    }

    /// Returns the numbers since `from`.
    fn since(&self, from: Duration) -> impl Iterator<Item = u32> + Clone {
        self.0.iter().filter(move |(at, _)| *at >= from).map(|(_, number)| *number)
    }
}

fn milliseconds(time: Duration) -> u32 {
    u32::try_from(time.as_millis()).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use plumb_protocol::config::Deadlines;
    use plumb_protocol::units::Milliseconds;

    use super::*;

    #[test]
    fn late_wakeups_are_counted_from_the_begin_of_the_count() {
        let mut evidence = Evidence::default();
        let ms = Duration::from_millis;
        evidence.sent(ms(1000));
        evidence.count_late_wakeups(ms(4000));
        // The time before the count is not of the run: a camera was opened then.
        evidence.sent(ms(4050));
        assert_eq!(evidence.late_wakeups(), None);
        for now in [4200, 4201, 4500, 5000] {
            evidence.sent(ms(now));
        }
        let expected = LateWakeups { times: 2, longest_s: 0.5 };
        assert_eq!(evidence.late_wakeups(), Some(expected));
        evidence.count_late_wakeups(ms(5000));
        assert_eq!(evidence.late_wakeups(), None);
    }

    #[test]
    fn a_ball_outside_is_told_with_the_border_that_it_has_passed() {
        let [min, max] =
            [[0.3, 0.1, 0.09], [0.8, 0.4, 0.6]].map(|it| Point::from_metres(it).unwrap());
        let config = Config { workspace: Workspace { min, max }, ..Config::example() };
        let mut evidence = Evidence::default();
        let mut told = |ball: [f64; 3]| {
            evidence.position(Duration::ZERO, Point::from_metres(ball), Duration::ZERO);
            // Pictures without the ball leave its last place.
            evidence.position(Duration::ZERO, None, Duration::ZERO);
            evidence.explain(Fault::BallOutside, &config, Duration::ZERO).to_string()
        };
        let below = told([0.7, 0.401, 0.086]);
        assert!(below.ends_with("(z = 0.086 m is below the 0.090 m of the workspace)"), "{below}");
        let above = told([0.7, 0.41, 0.086]);
        assert!(above.ends_with("(y = 0.410 m is above the 0.400 m of the workspace)"), "{above}");
        assert!(!told([0.7, 0.3, 0.3]).contains('('));
    }

    #[test]
    fn a_silence_before_the_run_explains_no_fault() {
        let (mut evidence, ms) = (Evidence::default(), Duration::from_millis);
        evidence.sent(ms(1000));
        // The detector was prepared for 3 s.
        evidence.count_late_wakeups(ms(4000));
        evidence.sent(ms(4010));
        evidence.sent(ms(4060));
        let [host, position, max_age] = [300, 500, 250].map(Milliseconds);
        let deadlines = Deadlines { host, position, max_age };
        let config = Config { deadlines, ..Config::example() };
        let cause = |evidence: &Evidence, now| {
            evidence.explain(Fault::PositionLost, &config, ms(now)).cause
        };
        assert_eq!(cause(&evidence, 4100), None);
        evidence.sent(ms(4460));
        assert!(matches!(cause(&evidence, 4500), Some(FaultCause::LateHost { times: 1, .. })));
    }
}
