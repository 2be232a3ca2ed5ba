//! Checks that every target of another node passes.

use std::time::Instant;

use nalgebra::Point3;
use plumb_runtime::operator::{Continuity, OperatorSender, SendCommandError, Stopped};
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
    /// A Stop holds.
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
    /// Where it is in another frame or no number, while a Stop holds, and after its Resume until
    /// the publisher begins anew.
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use plumb_runtime::operator::{OperatorCommand, operator};

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
        let (page, _receiver) = operator();
        let source = page.source("a publisher");
        let other = admission.admit(&message("map", 0.4), now, &source).unwrap_err().to_string();
        assert!(other.contains("`map`") && other.contains("`plumb/rig`"), "{other}");
        let none = admission.admit(&message("plumb/rig", f64::NAN), now, &source);
        assert_eq!(none, Err(TargetRefusal::NoNumber));
        page.send(OperatorCommand::Stop).unwrap();
        let stopped = admission.admit(&message("plumb/rig", 0.4), now, &source);
        let stopped = stopped.unwrap_err().to_string();
        assert!(stopped.contains("stop 1") && stopped.contains("/plumb/resume"), "{stopped}");
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
}
