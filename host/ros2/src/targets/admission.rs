//! Checks that every target of another node passes.

use std::time::Instant;

use nalgebra::Point3;
use plumb_runtime::targets::Omission;
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
    /// The rig was stopped.
    #[error("the rig was stopped: call the service `{resume}` first")]
    Stopped {
        /// Name of the service after which targets are accepted again.
        resume: String,
    },
    /// The target was sent before the last Resume, and came late.
    #[error("the target was sent before the rig was resumed: send it again")]
    BeforeResume,
    /// A command, a fault or a newer motion has ended the motion of the target.
    #[error(
        "a command, a fault or another motion has ended the motion of the target: call the service \
         `{resume}` first"
    )]
    MotionEnded {
        /// Name of the service that lets the publisher begin anew.
        resume: String,
    },
    /// The ball follows another publisher.
    #[error("another node publishes a moving target: one at a time is followed")]
    OtherPublisher,
    /// The target is late, out of order or out of range.
    #[error(transparent)]
    LeftOut(#[from] Omission),
}

/// Checks of targets: the frame, the numbers, and no stop.
#[derive(Debug)]
pub(crate) struct Admission {
    /// Name of the rig frame.
    frame: String,
    /// Name of the service after which targets are accepted again.
    resume: String,
    /// Time of the last Resume.
    resumed: Option<Instant>,
}

impl Admission {
    /// Returns the checks for targets in `frame`. After a stop the service `resume` makes the node
    /// accept them again.
    pub(crate) fn new(frame: String, resume: String) -> Self {
        Self { frame, resume, resumed: None }
    }

    /// Returns the place of a target, metres in the rig frame. Its publisher has sent it at `sent`.
    ///
    /// # Errors
    /// Where it is in another frame or no number, and where the rig was stopped.
    pub(crate) fn admit(
        &self,
        message: &PointStamped,
        sent: Instant,
        is_stopped: bool,
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
        if is_stopped {
            return Err(TargetRefusal::Stopped { resume: self.resume.clone() });
        }
        // DDS repeats lost messages, and keeps no order between a topic and a service.
        if self.resumed.is_some_and(|resumed| sent < resumed) {
            return Err(TargetRefusal::BeforeResume);
        }
        Ok(point)
    }

    /// Notes a Resume. Targets that were sent before it stay refused.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.resumed = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::message::{Header, Time};

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
        let other = admission.admit(&message("map", 0.4), now, false).unwrap_err().to_string();
        assert!(other.contains("`map`") && other.contains("`plumb/rig`"), "{other}");
        let none = admission.admit(&message("plumb/rig", f64::NAN), now, false);
        assert_eq!(none, Err(TargetRefusal::NoNumber));
        let stopped = admission.admit(&message("plumb/rig", 0.4), now, true);
        let stopped = stopped.unwrap_err().to_string();
        assert!(stopped.contains("/plumb/resume"), "{stopped}");
    }

    #[test]
    fn a_target_that_was_sent_before_a_resume_stays_refused() {
        let (mut admission, begin) = (admission(), Instant::now());
        let at = |milliseconds| begin + Duration::from_millis(milliseconds);
        admission.resume(at(100));
        let late = admission.admit(&message("plumb/rig", 0.4), at(90), false);
        assert_eq!(late, Err(TargetRefusal::BeforeResume));
        let target = admission.admit(&message("plumb/rig", 0.5), at(102), false).unwrap();
        assert_eq!(target.x, 0.5);
    }
}
