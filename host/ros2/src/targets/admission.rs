//! Admission of the targets of other nodes: the checks that each one passes, the least time between
//! two, and the publishers that send them.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_runtime::operator::{Continuity, OperatorSender, SendCommandError, Stopped};
use plumb_runtime::targets::Omission;
use ros2_client::Gid;
use thiserror::Error;

use crate::message::geometry::PointStamped;

/// Reason why a target is refused.
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
    /// A Stop is in force.
    #[error("{stopped}, with the service `{resume}`")]
    Stopped {
        /// The Stop.
        stopped: Stopped,
        /// Name of the service that ends it.
        resume: String,
    },
    /// The publisher went on while the rig was stopped and resumed.
    #[error(
        "the rig was stopped and resumed while this publisher went on: pause for a second, then \
         the next target counts"
    )]
    MustBeginAnew,
    /// The run takes no targets.
    #[error(transparent)]
    NotSent(SendCommandError),
    /// The target was sent before the last Resume, and came late.
    #[error("the target was sent before the rig was resumed: send it again")]
    BeforeResume,
    /// A command, a fault or a newer motion has ended the motion of the target.
    #[error(
        "a command, a fault or another motion has ended the motion of the target: pause for a \
         second, then the next target begins anew"
    )]
    MotionEnded,
    /// The ball follows another publisher.
    #[error("another node publishes a moving target: one at a time is followed")]
    OtherPublisher,
    /// The target is late, out of order or out of range.
    #[error(transparent)]
    LeftOut(#[from] Omission),
}

/// Checks of targets: the frame, the numbers, and no Stop.
#[derive(Debug)]
pub(crate) struct Admission {
    /// Name of the rig frame.
    frame: String,
    /// Name of the service that ends a Stop.
    resume: String,
}

impl Admission {
    /// Returns the checks for targets in `frame`. The service `resume` ends a Stop.
    pub(crate) fn new(frame: String, resume: String) -> Self {
        Self { frame, resume }
    }

    /// Returns the place of a target, metres in the rig frame. Its publisher, which is `source`,
    /// has sent it at `sent`.
    ///
    /// # Errors
    /// Where it is in another frame or no number, while a Stop is in force, and after its Resume
    /// until the publisher begins anew.
    pub(crate) fn admit(
        &self,
        message: &PointStamped,
        sent: Instant,
        source: &OperatorSender,
    ) -> Result<Point3<f64>, TargetRefusal> {
        let found = &message.header.frame_id;
        if *found != self.frame {
            let expected = self.frame.clone();
            return Err(TargetRefusal::Frame { found: found.clone(), expected });
        }
        let point = Point3::from(message.point);
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(TargetRefusal::NoNumber);
        }
        // DDS repeats lost messages, and keeps no order between a topic and a service.
        if source.stop().is_none() && source.resumed().is_some_and(|resumed| sent < resumed) {
            return Err(TargetRefusal::BeforeResume);
        }
        match source.admit_target(Continuity::MayGoOn) {
            Ok(()) => Ok(point),
            Err(SendCommandError::Stopped(stopped)) => {
                Err(TargetRefusal::Stopped { stopped, resume: self.resume.clone() })
            }
            Err(SendCommandError::MustBeginAnew) => Err(TargetRefusal::MustBeginAnew),
            Err(error) => Err(TargetRefusal::NotSent(error)),
        }
    }
}

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

/// Number of publishers above which those that are silent are forgotten.
const MANY: usize = 64;

/// Senders of the publishers' targets.
#[derive(Debug)]
pub(super) struct Sources {
    operator: OperatorSender,
    senders: HashMap<Gid, OperatorSender>,
}

impl Sources {
    /// Returns the sources of targets for the run of `operator`.
    pub(super) fn new(operator: OperatorSender) -> Self {
        Self { operator, senders: HashMap::new() }
    }

    /// Returns the sender of a publisher's targets. `topic` names it for people.
    pub(super) fn of(&mut self, publisher: Gid, topic: &str) -> OperatorSender {
        if self.senders.len() > MANY {
            // A silent publisher begins anew anyway.
            self.senders.retain(|_, sender| !sender.is_silent());
        }
        let new = || self.operator.source(&format!("a publisher on {topic}"));
        self.senders.entry(publisher).or_insert_with(new).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Header, Time};
    use plumb_runtime::operator::{OperatorCommand, operator};
    use std::time::Duration;

    fn admission() -> Admission {
        Admission::new("plumb/rig".to_owned(), "/plumb/resume".to_owned())
    }

    fn message(frame: &str, x: f64) -> PointStamped {
        let header = Header { stamp: Time::from_nanoseconds(0), frame_id: frame.to_owned() };
        PointStamped { header, point: Point3::new(x, 0.3, 0.2).into() }
    }

    #[test]
    fn a_target_in_another_frame_or_after_a_stop_is_refused() {
        let (admission, now) = (admission(), Instant::now());
        let (page, _receiver) = operator();
        let source = page.source("a publisher");
        let other = admission.admit(&message("map", 0.4), now, &source).unwrap_err().to_string();
        assert!(other.contains("`map`") && other.contains("`plumb/rig`"), "{other}");
        let none = admission.admit(&message("plumb/rig", f64::NAN), now, &source);
        assert_eq!(none, Err(TargetRefusal::NoNumber));
        page.send(OperatorCommand::Stop).unwrap();
        let stopped = admission.admit(&message("plumb/rig", 0.4), now, &source);
        let stopped = stopped.unwrap_err().to_string();
        assert!(stopped.contains("command 1") && stopped.contains("/plumb/resume"), "{stopped}");
    }

    #[test]
    fn a_publisher_that_goes_on_over_a_resume_and_a_late_target_stay_refused() {
        let (admission, begin) = (admission(), Instant::now());
        let (page, _receiver) = operator();
        let source = page.source("a publisher");
        admission.admit(&message("plumb/rig", 0.4), begin, &source).unwrap();
        let stop = page.send(OperatorCommand::Stop).unwrap();
        page.send(OperatorCommand::Resume { stop }).unwrap();
        let new = page.source("a new publisher");
        let late = admission.admit(&message("plumb/rig", 0.4), begin, &new);
        assert_eq!(late, Err(TargetRefusal::BeforeResume));
        let now = Instant::now() + Duration::from_millis(1);
        let goes_on = admission.admit(&message("plumb/rig", 0.4), now, &source);
        assert_eq!(goes_on, Err(TargetRefusal::MustBeginAnew));
        assert_eq!(admission.admit(&message("plumb/rig", 0.5), now, &new).unwrap().x, 0.5);
    }

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

    #[test]
    fn silent_publishers_are_forgotten_and_those_that_send_are_not() {
        let (operator, _receiver) = operator();
        let mut sources = Sources::new(operator);
        let gid = |k: u8| Gid::from([k; 16]);
        for k in 0..5 {
            sources.of(gid(k), "/plumb/target").send(OperatorCommand::Hold).unwrap();
        }
        for k in 5..=255 {
            let _silent = sources.of(gid(k), "/plumb/target");
        }
        assert!(sources.senders.len() <= MANY + 1, "{}", sources.senders.len());
        assert!((0..5).all(|k| sources.senders.contains_key(&gid(k))));
    }
}
