//! The operator of a run: commands from other threads, such as a page or a terminal.
//!
//! [`operator`] returns a sender, which any number of threads may clone, and the receiver for
//! [`RunParts::operator`](crate::run::RunParts). A command ends the control loop's wait for a
//! frame. Its outcome is a [`RunEvent::Command`](crate::observer::RunEvent::Command) with the
//! number that [`OperatorSender::send`] returned.
//!
//! [`OperatorSender::targets`] sends targets that move, which need no answers.
//!
//! A Stop is in force: what moves the ball is refused, whoever sends it, before an
//! [`OperatorCommand::Resume`] with the number of the Stop. A Resume moves nothing, and what was
//! sending begins anew ([`BEGINS_ANEW_AFTER`]). Each page or program is a source of its own
//! ([`OperatorSender::source`]).
//!
//! With an operator a run does not end after the last target, a timeout, a Stop or a fault: the
//! board holds or rests, and the observers receive every frame, until [`OperatorCommand::End`], an
//! interruption or a failure. A command that changes the motion ends the list of targets.
//!
//! ```
//! use nalgebra::Point3;
//! use plumb_runtime::operator::{OperatorCommand, operator};
//!
//! let (sender, receiver) = operator();
//! let page = sender.clone();
//! let target = page.send(OperatorCommand::Target(Point3::new(0.40, 0.40, 0.15)))?;
//! let stop = sender.send(OperatorCommand::Stop)?;
//! assert!(stop > target);
//! // RunParts { operator: Some(receiver), .. }
//! drop(receiver);
//! assert!(sender.send(OperatorCommand::Stop).is_err());
//! # Ok::<(), plumb_runtime::operator::SendCommandError>(())
//! ```

mod channel;
mod command;
mod stop_latch;

pub(crate) use channel::Submitted;
pub use channel::{
    MAX_WAITING, OperatorClock, OperatorReceiver, OperatorSender, SendCommandError, operator,
    operator_with_clock,
};
pub use command::{CommandOutcome, CommandRefusal, OperatorCommand};
pub use stop_latch::{BEGINS_ANEW_AFTER, Continuity, ResumeError, Stop, StopEvent, Stopped};
