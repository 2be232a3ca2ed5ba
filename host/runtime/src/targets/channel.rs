//! Queue of targets from other threads to the control loop.

use std::collections::VecDeque;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use nalgebra::{Point3, Vector3};

use super::intake::MAX_AGE_S;
use super::source::{Arrivals, LeftOut, MotionId, SourceEnd, TargetSource, TimedTarget};

/// Number of targets that may wait: those of a second at 250 Hz. Newer ones replace the oldest.
pub const MAX_WAITING: usize = 250;

/// Number of messages about lines that are told in a run, and of those about senders. The others
/// are only counted.
const MAX_PROBLEMS: u32 = 10;

/// Sender of targets. Clones send to the same run.
#[derive(Debug, Clone)]
pub struct TargetSender(Arc<Mutex<Queue>>);

/// Receiver of targets, for [`Run::set_targets`](crate::run::Run::set_targets).
#[derive(Debug)]
pub struct TargetReceiver(Arc<Mutex<Queue>>);

/// A target and when it was there.
#[derive(Debug, Clone, Copy)]
struct Sent {
    motion: MotionId,
    at: Instant,
    position: Point3<f64>,
    velocity: Option<Vector3<f64>>,
}

#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<Sent>,
    problems: Vec<String>,
    /// Number of problems of lines.
    of_lines: u32,
    /// Number of problems of senders.
    of_senders: u32,
    left_out: LeftOut,
    /// Newest motion.
    motion: MotionId,
    /// Newest motion that a command or a fault has ended.
    cancelled: Option<MotionId>,
    end: Option<SourceEnd>,
    /// Whether the run has begun to take targets.
    is_taken: bool,
}

/// Returns the two ends of a new queue of targets.
pub fn target_channel() -> (TargetSender, TargetReceiver) {
    let queue = Arc::new(Mutex::new(Queue::default()));
    (TargetSender(Arc::clone(&queue)), TargetReceiver(queue))
}

impl TargetSender {
    /// Begins a motion. Targets of older ones are left out from its first target on.
    #[must_use]
    pub fn begin(&self) -> MotionId {
        let mut queue = lock(&self.0);
        queue.motion.0 += 1;
        queue.motion
    }

    /// Sends that the target of `motion` was at `position` (metres in the rig frame) at `at`, with
    /// `velocity` (m/s) where it is known. Does not wait: where [`MAX_WAITING`] targets wait, the
    /// oldest is left out.
    pub fn send(
        &self,
        motion: MotionId,
        at: Instant,
        position: Point3<f64>,
        velocity: Option<Vector3<f64>>,
    ) {
        let mut queue = lock(&self.0);
        if queue.waiting.len() >= MAX_WAITING {
            queue.waiting.pop_front();
            queue.left_out.skipped += 1;
        }
        queue.waiting.push_back(Sent { motion, at, position, velocity });
    }

    /// Returns whether a command, a fault or a newer motion has ended `motion`: the run leaves its
    /// targets out.
    #[must_use]
    pub fn has_ended(&self, motion: MotionId) -> bool {
        let queue = lock(&self.0);
        motion < queue.motion || queue.cancelled.is_some_and(|cancelled| motion <= cancelled)
    }

    /// Counts something that was left out, and tells why; the first few times only.
    pub fn reject(&self, problem: String, count: impl FnOnce(&mut LeftOut)) {
        self.leave_out(problem, count, |queue| &mut queue.of_lines);
    }

    /// Tells why no more targets come from a sender, and counts what was left out of it. Many bad
    /// lines before do not hide it.
    pub(super) fn give_up(&self, problem: String, count: impl FnOnce(&mut LeftOut)) {
        self.leave_out(problem, count, |queue| &mut queue.of_senders);
    }

    /// Counts something that was left out, and tells why where few problems were told before: those
    /// of the kind whose number `told` returns.
    fn leave_out(
        &self,
        problem: String,
        count: impl FnOnce(&mut LeftOut),
        told: impl FnOnce(&mut Queue) -> &mut u32,
    ) {
        let mut queue = lock(&self.0);
        count(&mut queue.left_out);
        let told = told(&mut queue);
        *told = told.saturating_add(1);
        match *told {
            ..MAX_PROBLEMS => queue.problems.push(problem),
            MAX_PROBLEMS => {
                queue.problems.push(format!("{problem} (further ones are only counted)"));
            }
            _ => {}
        }
    }

    /// Returns whether the run has begun to take targets.
    pub(super) fn is_taken(&self) -> bool {
        lock(&self.0).is_taken
    }

    /// Tells that no target follows: the ball comes to rest at the last one.
    pub(super) fn end(&self, end: SourceEnd) {
        lock(&self.0).end = Some(end);
    }
}

impl Queue {
    /// Leaves out the targets that came too long before the run, but for the last one of all: where
    /// it is as old, it becomes one of the present.
    fn leave_out_old(&mut self, present: Instant) {
        let age = |sent: &Sent| present.saturating_duration_since(sent.at).as_secs_f64();
        let (before, last) = (self.waiting.len(), self.waiting.back().copied());
        self.waiting.retain(|sent| age(sent) <= MAX_AGE_S);
        if let Some(last) = last.filter(|_| self.waiting.is_empty()) {
            self.waiting.push_back(Sent { at: present, ..last });
        }
        self.left_out.skipped += (before - self.waiting.len()) as u64;
    }
}

impl TargetSource for TargetReceiver {
    fn take(&mut self, now: f64) -> Arrivals {
        let mut queue = lock(&self.0);
        // After the lock: no target is of the future.
        let present = Instant::now();
        if !mem::replace(&mut queue.is_taken, true) {
            queue.leave_out_old(present);
        }
        let targets = queue.waiting.drain(..).map(|Sent { motion, at, position, velocity }| {
            let time = now - present.saturating_duration_since(at).as_secs_f64();
            TimedTarget { motion, time, position, velocity }
        });
        Arrivals {
            targets: targets.collect(),
            problems: mem::take(&mut queue.problems),
            left_out: queue.left_out,
            end: queue.end,
        }
    }

    fn newest_motion(&self) -> MotionId {
        lock(&self.0).motion
    }

    fn cancel(&mut self) -> MotionId {
        let mut queue = lock(&self.0);
        queue.cancelled = Some(queue.motion);
        queue.motion
    }
}

fn lock(queue: &Mutex<Queue>) -> MutexGuard<'_, Queue> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_newest_targets_win_and_keep_their_times() {
        let (sender, mut receiver) = target_channel();
        assert_eq!(receiver.take(99.0), Arrivals::default());
        let motion = sender.begin();
        let begin = Instant::now();
        for k in 0..MAX_WAITING + 50 {
            let at = begin - Duration::from_millis(k as u64);
            sender.send(motion, at, Point3::new(k as f64, 0.0, 0.0), None);
        }
        let Arrivals { targets, left_out, end, .. } = receiver.take(100.0);
        assert_eq!((targets.len(), left_out.skipped, end), (MAX_WAITING, 50, None));
        assert_eq!(targets[0].position.x, 50.0);
        // The times of two differ as they were sent, whenever they are taken.
        let passed = targets[0].time - targets[1].time;
        assert!((passed - 1e-3).abs() < 1e-9 && targets[0].time <= 100.0 - 0.05, "{passed}");
        assert_eq!(receiver.take(101.0).targets, []);
        sender.end(SourceEnd::Complete);
        assert_eq!(receiver.take(101.0).end, Some(SourceEnd::Complete));
    }

    #[test]
    fn of_targets_from_before_the_run_the_last_counts_as_if_it_came_now() {
        let (sender, mut receiver) = target_channel();
        let motion = sender.begin();
        let long_ago = Instant::now() - Duration::from_secs(9);
        for x in [0.1, 0.2, 0.3] {
            sender.send(motion, long_ago, Point3::new(x, 0.0, 0.0), None);
        }
        let Arrivals { targets, left_out, .. } = receiver.take(100.0);
        assert_eq!((targets.len(), left_out.skipped), (1, 2));
        assert_eq!((targets[0].position.x, targets[0].time), (0.3, 100.0));
        sender.send(motion, long_ago, Point3::origin(), None);
        assert!(receiver.take(101.0).targets[0].time < 93.0);
    }

    #[test]
    fn a_stream_that_goes_on_as_the_run_begins_has_no_late_targets() {
        let (sender, mut receiver) = target_channel();
        let motion = sender.begin();
        let now = Instant::now();
        for tenths in (0..20).rev() {
            let at = now - Duration::from_millis(100 * tenths);
            sender.send(motion, at, Point3::new(tenths as f64, 0.0, 0.0), None);
        }
        let Arrivals { targets, left_out, .. } = receiver.take(100.0);
        assert!(targets.iter().all(|target| 100.0 - target.time <= MAX_AGE_S), "{targets:?}");
        assert_eq!(targets.last().unwrap().position.x, 0.0);
        assert_eq!(left_out.skipped, 20 - targets.len() as u64);
        assert_eq!(left_out.late, 0);
    }

    #[test]
    fn a_motion_ends_with_a_command_and_with_a_newer_motion() {
        let (sender, mut receiver) = target_channel();
        let first = sender.begin();
        assert!(!sender.has_ended(first));
        assert_eq!(receiver.cancel(), first);
        assert!(sender.has_ended(first));
        let second = sender.begin();
        assert!(!sender.has_ended(second) && sender.has_ended(first));
        let third = sender.begin();
        assert!(sender.has_ended(second) && !sender.has_ended(third));
    }

    #[test]
    fn few_problems_are_told_and_all_are_counted() {
        let (sender, mut receiver) = target_channel();
        for k in 0..1000 {
            sender.reject(format!("line {k}"), |left_out| left_out.unreadable += 1);
        }
        let Arrivals { problems, left_out, .. } = receiver.take(0.0);
        assert_eq!((problems.len(), left_out.unreadable), (10, 1000));
        assert_eq!(problems[9], "line 9 (further ones are only counted)");
        sender.give_up("ended".to_owned(), |_| {});
        assert_eq!(receiver.take(0.0).problems, ["ended"]);
    }
}
