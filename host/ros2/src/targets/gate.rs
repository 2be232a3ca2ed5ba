//! Set points from a topic: which is sent when.

use std::time::{Duration, Instant};

use nalgebra::Point3;

/// Least time between two targets that are sent to the board. A node that sends more of them gets
/// the newest ones through.
const MIN_INTERVAL: Duration = Duration::from_millis(50);

/// Targets between a topic and the control loop: one at a time, the newest one next.
#[derive(Debug, Default)]
pub(crate) struct TargetGate {
    waiting: Option<Point3<f64>>,
    /// Whether the answer to a target is due.
    is_busy: bool,
    /// Time of the last target that was sent.
    sent: Option<Instant>,
}

impl TargetGate {
    /// Takes a target. One that waits is replaced.
    pub(crate) fn offer(&mut self, target: Point3<f64>) {
        self.waiting = Some(target);
    }

    /// Removes and returns the target to send now. `present` is the one that the rig drives to or
    /// holds: it is not sent again.
    pub(crate) fn next(
        &mut self,
        present: Option<Point3<f64>>,
        now: Instant,
    ) -> Option<Point3<f64>> {
        let is_early = self.sent.is_some_and(|sent| now < sent + MIN_INTERVAL);
        if self.is_busy || is_early {
            return None;
        }
        let target = self.waiting.take().filter(|target| Some(*target) != present)?;
        (self.is_busy, self.sent) = (true, Some(now));
        Some(target)
    }

    /// Returns the time at which the target that waits may be sent.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.waiting.filter(|_| !self.is_busy)?;
        self.sent.map(|sent| sent + MIN_INTERVAL)
    }

    /// Notes that the target that was sent has its answer.
    pub(crate) fn answered(&mut self) {
        self.is_busy = false;
    }

    /// Drops the target that waits.
    pub(crate) fn clear(&mut self) {
        self.waiting = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(x: f64) -> Point3<f64> {
        Point3::new(x, 0.3, 0.2)
    }

    #[test]
    fn the_newest_of_many_targets_is_sent_after_the_answer_and_the_interval() {
        let (mut gate, start) = (TargetGate::default(), Instant::now());
        let mut sent = Vec::new();
        for k in 0..1000_u32 {
            let now = start + Duration::from_millis(u64::from(k));
            gate.offer(target(f64::from(k)));
            if let Some(target) = gate.next(None, now) {
                sent.push(target.x);
            }
            // The answer takes 70 ms from the tenth target on.
            if sent.len() < 10 || k % 70 == 0 {
                gate.answered();
            }
        }
        assert_eq!(sent[..4], [0.0, 50.0, 100.0, 150.0]);
        assert!((16..=20).contains(&sent.len()), "{sent:?}");
    }

    #[test]
    fn the_present_target_is_not_sent_again() {
        let (mut gate, now) = (TargetGate::default(), Instant::now());
        gate.offer(target(0.4));
        assert_eq!(gate.next(Some(target(0.4)), now), None);
        gate.offer(target(0.4));
        gate.clear();
        assert_eq!(gate.next(None, now), None);
        gate.offer(target(0.4));
        assert_eq!(gate.next(None, now), Some(target(0.4)));
    }
}
