//! Targets from a topic: which are refused, and which is sent when.

use std::time::{Duration, Instant};

use nalgebra::Point3;
use thiserror::Error;

use crate::message::geometry::PointStamped;

/// Least time between two targets that are sent to the board. A node that sends more of them gets
/// the newest ones through.
const MIN_INTERVAL: Duration = Duration::from_millis(50);

/// Reason why a target is not sent.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum TargetRefusal {
    /// The target is in another frame than the rig's.
    #[error("the target is in the frame `{found}`, but `{expected}` is needed")]
    Frame {
        /// Frame of the message.
        found: String,
        /// Frame of the rig.
        expected: String,
    },
    /// A coordinate is no number.
    #[error("a coordinate of the target is no number")]
    NoNumber,
    /// The rig was stopped.
    #[error("the rig was stopped: call the service `{resume}` first")]
    Stopped {
        /// Name of the service that lets targets in again.
        resume: String,
    },
    /// The target was sent before the last Resume, and came late.
    #[error("the target was sent before the rig was resumed: send it again")]
    BeforeResume,
}

/// Targets between a topic and the control loop: one at a time, the newest one next.
#[derive(Debug)]
pub(crate) struct TargetGate {
    /// Name of the rig frame.
    frame: String,
    /// Name of the service that lets targets in again after a stop.
    resume: String,
    waiting: Option<Point3<f64>>,
    /// Whether the answer to a target is due.
    is_busy: bool,
    /// Time of the last target that was sent.
    sent: Option<Instant>,
    /// Time of the last Resume.
    resumed: Option<Instant>,
}

impl TargetGate {
    /// Returns a gate for targets in `frame`, which the service `resume` opens after a stop.
    pub(crate) fn new(frame: String, resume: String) -> Self {
        Self { frame, resume, waiting: None, is_busy: false, sent: None, resumed: None }
    }

    /// Takes a target, which its publisher has sent at `sent`. One that waits is replaced.
    ///
    /// # Errors
    /// Where it is not acceptable. The one that waits stays.
    pub(crate) fn offer(
        &mut self,
        message: &PointStamped,
        sent: Instant,
        is_stopped: bool,
    ) -> Result<(), TargetRefusal> {
        let found = &message.header.frame_id;
        if *found != self.frame {
            let expected = self.frame.clone();
            return Err(TargetRefusal::Frame { found: found.clone(), expected });
        }
        let point = Point3::from(message.point);
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(TargetRefusal::NoNumber);
        }
        if is_stopped {
            return Err(TargetRefusal::Stopped { resume: self.resume.clone() });
        }
        // DDS repeats lost messages, and keeps no order between a topic and a service.
        if self.resumed.is_some_and(|resumed| sent < resumed) {
            return Err(TargetRefusal::BeforeResume);
        }
        self.waiting = Some(point);
        Ok(())
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

    /// Notes a Resume. Targets that were sent before it stay refused.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.resumed = Some(now);
    }

    /// Drops the target that waits.
    pub(crate) fn clear(&mut self) {
        self.waiting = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Header, Time};

    fn gate() -> TargetGate {
        TargetGate::new("plumb/rig".to_owned(), "/plumb/resume".to_owned())
    }

    fn message(frame: &str, x: f64) -> PointStamped {
        let header = Header { stamp: Time::from_nanoseconds(0), frame_id: frame.to_owned() };
        PointStamped { header, point: Point3::new(x, 0.3, 0.2).into() }
    }

    #[test]
    fn the_newest_of_many_targets_is_sent_after_the_answer_and_the_interval() {
        let (mut gate, start) = (gate(), Instant::now());
        let mut sent = Vec::new();
        for k in 0..1000_u32 {
            let now = start + Duration::from_millis(u64::from(k));
            gate.offer(&message("plumb/rig", f64::from(k)), now, false).unwrap();
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
    fn a_target_in_another_frame_or_after_a_stop_is_refused() {
        let (mut gate, now) = (gate(), Instant::now());
        let other = gate.offer(&message("map", 0.4), now, false).unwrap_err().to_string();
        assert!(other.contains("`map`") && other.contains("`plumb/rig`"), "{other}");
        let none = gate.offer(&message("plumb/rig", f64::NAN), now, false);
        assert_eq!(none, Err(TargetRefusal::NoNumber));
        let stopped = gate.offer(&message("plumb/rig", 0.4), now, true).unwrap_err().to_string();
        assert!(stopped.contains("/plumb/resume"), "{stopped}");
        assert_eq!(gate.next(None, now), None);
    }

    #[test]
    fn a_target_that_was_sent_before_a_resume_stays_refused() {
        let (mut gate, begin) = (gate(), Instant::now());
        let at = |milliseconds| begin + Duration::from_millis(milliseconds);
        gate.offer(&message("plumb/rig", 0.4), at(0), true).unwrap_err();
        gate.resume(at(100));
        let late = gate.offer(&message("plumb/rig", 0.4), at(90), false);
        assert_eq!(late, Err(TargetRefusal::BeforeResume));
        assert_eq!(gate.next(None, at(101)), None);
        gate.offer(&message("plumb/rig", 0.5), at(102), false).unwrap();
        assert_eq!(gate.next(None, at(103)).map(|target| target.x), Some(0.5));
    }

    #[test]
    fn the_present_target_is_not_sent_again() {
        let (mut gate, now) = (gate(), Instant::now());
        let target = Point3::new(0.4, 0.3, 0.2);
        gate.offer(&message("plumb/rig", 0.4), now, false).unwrap();
        assert_eq!(gate.next(Some(target), now), None);
        gate.offer(&message("plumb/rig", 0.4), now, false).unwrap();
        gate.clear();
        assert_eq!(gate.next(None, now), None);
        gate.offer(&message("plumb/rig", 0.4), now, false).unwrap();
        assert_eq!(gate.next(None, now), Some(target));
    }
}
