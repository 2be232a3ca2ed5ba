//! Targets that move: what comes from their source, the messages to the board, and how well the
//! ball follows.

use nalgebra::{Point3, Vector3};
use plumb_path::tracker::{Course, TargetTracker};
use plumb_path::trajectory::Moment;
use plumb_protocol::config::Workspace;
use plumb_protocol::message::{Reference, State, Telemetry};

use super::chase::{Chase, PAUSE_S, REST_SPEED};
use super::path::LEAST_PERIOD_S;
use super::sent_positions::SentPosition;
use crate::deviation::{Deviations, PathPoint};
use crate::event::TargetsEvent;
use crate::reference::{keep_inside, reference};
use crate::rig::{MotionError, MotionRules};
use crate::targets::{Arrivals, LeftOut, MAX_AGE_S, MotionId, SourceEnd, TimedTarget};
use crate::targets_summary::TargetsSummary;

/// Time after the first target after which the run says that the board follows none, seconds.
const NOT_FOLLOWED_S: f64 = 3.0;

/// Least time between two events about places that are not allowed, seconds.
const LEAST_REFUSAL_S: f64 = 1.0;

/// Longest time since the last position with the ball was sent, seconds: a follower begins where
/// the ball is, and the board's own deadline is longer.
const FRESH_S: f64 = 0.25;

/// Longest time since the position that the board has told of was sent, seconds: no link that
/// drives is slower to answer.
const ANSWER_S: f64 = 1.0;

/// Distance of the ball from the target beyond which the reference waits for the ball, metres: it
/// would run away from a ball that cannot follow a jump.
const FAR_M: f64 = 0.06;

/// Distance within which the reference goes with the target again, metres.
const NEAR_M: f64 = 0.04;

/// Distance within which a place is the same, metres.
pub(in crate::run) const REST_M: f64 = 1e-4;

/// What targets that move are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetUse {
    /// They are the goal of the run: it has no others, and ends where they end. A command of the
    /// operator ends them for good.
    Goal,
    /// They steer a run with an operator, beside its commands.
    Steering,
}

/// Rules for the places of targets.
pub(crate) struct TargetRules {
    pub(crate) motion: MotionRules,
    pub(crate) workspace: Workspace,
    /// Largest speed of a reference, m/s.
    pub(crate) max_speed: f64,
    /// Distance within which the ball is at its target, metres.
    pub(crate) radius: f64,
}

/// Drive after a target that moves. Times are in seconds on the clock of the pictures.
pub(crate) struct TargetDrive {
    usage: TargetUse,
    rules: TargetRules,
    tracker: TargetTracker,
    /// Where the target goes, as last sent.
    course: Option<Course>,
    /// Motion of the last target.
    motion: MotionId,
    /// Newest motion that a command has ended.
    cancelled: Option<MotionId>,
    /// How the source ended; `None` while more may come.
    end: Option<SourceEnd>,
    /// Zero of the path's time.
    zero: Option<f64>,
    last_sent: Option<f64>,
    /// Time of the last target that was taken, or of the start of the run.
    last_taken: Option<f64>,
    /// Time of the first target that was taken.
    first_taken: Option<f64>,
    is_wait_told: bool,
    last_refusal: Option<f64>,
    /// Time at which a target was last left out.
    last_unused: Option<f64>,
    is_paused: bool,
    /// Place of the ball in the last picture that shows it, metres.
    ball: Option<Point3<f64>>,
    /// Whether the ball is far from its target.
    is_far: bool,
    chase: Chase,
    deviations: Deviations,
    counts: Counts,
}

/// Counts of a drive.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    taken: u64,
    refused: u64,
    ended: u64,
    pauses: u64,
    /// What the drive left out.
    here: LeftOut,
    /// What the source left out.
    source: LeftOut,
}

impl TargetDrive {
    pub(crate) fn new(usage: TargetUse, rules: TargetRules) -> Self {
        Self {
            usage,
            tracker: TargetTracker::new(rules.max_speed),
            rules,
            course: None,
            motion: MotionId::default(),
            cancelled: None,
            end: None,
            zero: None,
            last_sent: None,
            last_taken: None,
            first_taken: None,
            is_wait_told: false,
            last_refusal: None,
            last_unused: None,
            is_paused: false,
            ball: None,
            is_far: true,
            chase: Chase::default(),
            deviations: Deviations::default(),
            counts: Counts::default(),
        }
    }

    /// Takes what has come until `now`. Returns what happened.
    pub(crate) fn take(&mut self, arrivals: Arrivals, now: f64) -> Vec<TargetsEvent> {
        let Arrivals { targets, problems, left_out, end } = arrivals;
        let unused = self.unused();
        self.counts.source = left_out;
        let mut events: Vec<_> = problems.into_iter().map(TargetsEvent::LeftOut).collect();
        for target in targets {
            events.extend(self.take_target(target, now));
        }
        if self.unused() > unused {
            self.last_unused = Some(now);
        }
        if self.end.is_none() && end.is_some() {
            self.end = end;
            self.tracker.rest(now);
            // The last place is sent at once: the run ends there.
            self.last_sent = None;
            events.push(TargetsEvent::Ended);
        }
        let silence = self.silence(now);
        if !self.is_paused && self.end.is_none() && self.has_begun() && silence > PAUSE_S {
            self.is_paused = true;
            self.counts.pauses += 1;
            events.push(TargetsEvent::Ceased);
        }
        if self.unfollowed(now) > NOT_FOLLOWED_S && !self.is_wait_told {
            self.is_wait_told = true;
            events.push(TargetsEvent::NotFollowed);
        }
        if self.chase.take_lag() {
            events.push(TargetsEvent::Lagging);
        }
        events
    }

    /// Takes a target. Returns what is to be told.
    fn take_target(&mut self, target: TimedTarget, now: f64) -> Option<TargetsEvent> {
        let TimedTarget { motion, time, position, velocity } = target;
        if motion < self.motion || self.cancelled.is_some_and(|cancelled| motion <= cancelled) {
            self.counts.ended += 1;
            return None;
        }
        if now - time > MAX_AGE_S {
            self.counts.here.late += 1;
            return None;
        }
        if let Err(error) = self.check(position) {
            self.counts.refused += 1;
            // The ball stays at the last good place.
            self.tracker.rest(time);
            let is_told = self.last_refusal.is_some_and(|last| now - last < LEAST_REFUSAL_S);
            self.last_refusal = Some(now);
            return (!is_told).then_some(TargetsEvent::Refused { position, error });
        }
        if motion != self.motion {
            (self.motion, self.tracker) = (motion, TargetTracker::new(self.rules.max_speed));
        }
        if !self.tracker.observe(time, position, velocity) {
            self.counts.here.out_of_order += 1;
            return None;
        }
        (self.counts.taken, self.last_taken) = (self.counts.taken + 1, Some(now));
        self.first_taken.get_or_insert(now);
        std::mem::take(&mut self.is_paused).then_some(TargetsEvent::Resumed)
    }

    /// Checks a place of the target, metres.
    fn check(&self, position: Point3<f64>) -> Result<(), MotionError> {
        self.rules.motion.check(position, Vector3::zeros())
    }

    /// Returns the place to begin at, metres, where a target waits, the board can follow it and
    /// knows where the ball is. `state` is the board's newest, `known` the position that it has
    /// told of, and `sent` the one that was sent last.
    pub(crate) fn begin(
        &self,
        state: State,
        known: Option<SentPosition>,
        sent: Option<SentPosition>,
        now: f64,
    ) -> Option<Point3<f64>> {
        let place = self.tracker.last_position()?;
        let may_follow = matches!(
            state,
            State::Ready | State::Seeking | State::Holding | State::Following | State::Stopping
        );
        let shows_ball = |position: Option<SentPosition>, longest: f64| {
            position.is_some_and(|it| it.has_ball && now - it.time <= longest)
        };
        let is_ball_known = shows_ball(known, ANSWER_S) && shows_ball(sent, FRESH_S);
        // The sender of an older target may have gone while the ball was hidden.
        let is_present = self.usage == TargetUse::Goal
            || self.last_taken.is_some_and(|last| now - last <= MAX_AGE_S);
        (may_follow && is_ball_known && is_present).then_some(place)
    }

    /// Notes that the board is to follow from now on.
    pub(crate) fn note_begun(&mut self, now: f64) {
        (self.is_far, self.last_sent) = (true, None);
        self.chase.begin();
        self.zero.get_or_insert(now);
    }

    /// Returns whether the targets are the goal of the run and nothing more will come.
    pub(crate) fn is_complete(&self) -> bool {
        self.end.is_some() && self.usage == TargetUse::Goal && self.cancelled.is_none()
    }

    /// Returns whether the targets are the goal of the run.
    pub(crate) fn is_goal(&self) -> bool {
        self.usage == TargetUse::Goal
    }

    /// Returns whether the targets are the goal of the run and their source could not be read on.
    pub(crate) fn is_broken(&self) -> bool {
        self.is_complete() && self.end == Some(SourceEnd::Broken)
    }

    /// Returns whether the newest targets were refused for their places.
    pub(crate) fn are_refused(&self) -> bool {
        self.last_refusal > self.last_taken
    }

    /// Returns whether the newest targets were left out for longer than one may be late: where they
    /// are, the ball is not sent.
    pub(crate) fn are_unused(&self) -> bool {
        let unused = self.last_unused.zip(self.last_taken);
        unused.is_some_and(|(unused, taken)| unused - taken > MAX_AGE_S)
    }

    /// Returns the number of targets that were refused or left out for their times. A line that
    /// cannot be read may be none, and those that newer ones replaced do not count.
    fn unused(&self) -> u64 {
        let Counts { refused, here, source, .. } = self.counts;
        let of = |left: LeftOut| left.out_of_order + left.late;
        refused + of(here) + of(source)
    }

    /// Returns whether a target was ever taken.
    pub(crate) fn has_taken(&self) -> bool {
        self.counts.taken > 0
    }

    /// Returns whether the board was ever to follow one.
    fn has_begun(&self) -> bool {
        self.zero.is_some()
    }

    /// Returns the time since the first target while the board follows none, seconds; 0 without
    /// one, and for targets that steer: a person sees why they are not followed.
    pub(crate) fn unfollowed(&self, now: f64) -> f64 {
        let first = self.first_taken.filter(|_| self.is_goal() && !self.has_begun());
        first.map_or(0.0, |first| now - first)
    }

    /// Forgets the targets so far.
    pub(crate) fn cancel(&mut self) {
        self.tracker = TargetTracker::new(self.rules.max_speed);
    }

    /// Notes that a command has ended the motions up to `newest`: a program whose motion was ended
    /// does not move the ball again by itself.
    pub(crate) fn note_cancelled(&mut self, newest: MotionId) {
        self.cancelled = Some(newest);
    }

    /// Returns the time since the last target, seconds; since the first call before there is one.
    pub(crate) fn silence(&mut self, now: f64) -> f64 {
        now - *self.last_taken.get_or_insert(now)
    }

    /// Returns the next message, where it is due at `now`. `state` is the board's, where its
    /// telemetry is about a message that comes to rest where the last one does.
    pub(crate) fn next_message(&mut self, state: Option<State>, now: f64) -> Option<Reference> {
        let is_early = self.last_sent.is_some_and(|last| now - last < LEAST_PERIOD_S);
        if is_early {
            return None;
        }
        let course = self.tracker.course(|place| self.check(place).is_ok())?;
        // A board that holds the ball at the rest of the target needs no more messages.
        if state == Some(State::Holding) && self.is_resting(&course, now) {
            return None;
        }
        (self.course, self.last_sent) = (Some(course), Some(now));
        let zero = *self.zero.get_or_insert(now);
        let motion = |time: f64| {
            let moment = course.at(time + zero);
            moment.unwrap_or_else(|| Moment::resting(Point3::origin()))
        };
        let limit = if self.is_far { NEAR_M } else { FAR_M };
        self.is_far = self.distance(&course, now).is_none_or(|distance| distance > limit);
        let mut message = reference(0, self.is_far, now - zero, now - zero, motion);
        keep_inside(&mut message, &self.rules.workspace);
        Some(message)
    }

    /// Returns whether the target rests at `now` where it came to rest by the last message.
    fn is_resting(&self, course: &Course, now: f64) -> bool {
        let Some((moment, rest)) = course.at(now).zip(self.rest()) else { return false };
        moment.velocity.norm() <= REST_SPEED && (moment.position - rest).norm() <= REST_M
    }

    /// Returns the distance of the ball from its target at `now`, metres.
    fn distance(&self, course: &Course, now: f64) -> Option<f64> {
        Some((self.ball? - course.at(now)?.position).norm())
    }

    /// Notes the place of the ball, metres.
    pub(crate) fn note_ball(&mut self, ball: Point3<f64>) {
        self.ball = Some(ball);
    }

    /// Returns where the target comes to rest if nothing more comes, metres.
    pub(crate) fn rest(&self) -> Option<Point3<f64>> {
        self.course?.at(f64::MAX).map(|moment| moment.position)
    }

    /// Returns the target at the time `stamp` of a picture, while the board follows it or holds the
    /// ball there.
    pub(crate) fn point(&self, stamp: f64, telemetry: &Telemetry) -> Option<PathPoint> {
        // The board holds the ball where the target rests.
        if !matches!(telemetry.state, State::Following | State::Holding) {
            return None;
        }
        let known = self.tracker.at(stamp);
        let moment = known.or_else(|| self.course.and_then(|course| course.at(stamp)))?;
        Some(PathPoint {
            time: (stamp - self.zero?).max(0.0),
            pace: telemetry.reference.map_or(0.0, |reference| f64::from(reference.pace) / 256.0),
            position: moment.position,
            velocity: moment.velocity,
        })
    }

    /// Returns whether the ball has caught up since the board began to follow the target.
    pub(crate) fn has_caught_up(&self) -> bool {
        self.chase.has_caught_up()
    }

    /// Adds the deviation of a measured position, metres, once the ball has caught up. A ball at
    /// the last target that counted is not at those that were sent since.
    pub(crate) fn note_position(&mut self, point: &PathPoint, position: Point3<f64>) {
        if self.are_unused() {
            self.chase.note(point, f64::INFINITY);
            return;
        }
        self.chase.note(point, (position - point.position).norm() / self.rules.radius);
        if self.chase.has_caught_up() {
            self.deviations.add(point, position);
        }
    }

    /// Returns the summary; `None` of targets that only steer, where none came.
    pub(crate) fn summary(&self) -> Option<TargetsSummary> {
        let Counts { taken, refused, ended, pauses, here, source } = self.counts;
        if taken == 0 && self.usage == TargetUse::Steering {
            return None;
        }
        let left_out = LeftOut {
            unreadable: source.unreadable,
            out_of_order: source.out_of_order + here.out_of_order,
            late: source.late + here.late,
            skipped: source.skipped,
        };
        let Chase { followed, near, .. } = self.chase;
        let spreads = Some(self.deviations.spreads()).filter(|spreads| spreads.frames > 0);
        Some(TargetsSummary { taken, refused, ended, left_out, pauses, followed, near, spreads })
    }
}
