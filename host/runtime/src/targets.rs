//! Targets that move: from another program, a page or a network to a run.
//!
//! [`target_channel`] returns a sender, which any number of threads may clone, and the receiver for
//! [`Run::set_targets`](crate::run::Run::set_targets). [`TargetStream`] reads lines of JSON from
//! another program and sends what they tell. The control loop never waits for a target: it takes
//! those that have come, and the newest ones win.
//!
//! ```
//! use std::time::Instant;
//!
//! use nalgebra::Point3;
//! use plumb_runtime::targets::target_channel;
//!
//! let (sender, receiver) = target_channel();
//! let motion = sender.begin();
//! sender.send(motion, Instant::now(), Point3::new(0.40, 0.40, 0.15), None);
//! // run.set_targets(Box::new(receiver), TargetUse::Goal)
//! # drop(receiver);
//! ```

mod channel;
mod intake;
mod line;
mod source;
mod stream;

pub use channel::{MAX_WAITING, TargetReceiver, TargetSender, target_channel};
pub use intake::{
    Beginning, LineIntake, MAX_AGE_S, Omission, OmissionKind, SenderFault, TargetClock,
};
pub use line::{LineMistake, MAX_LINE_BYTES, TargetLine};
pub use source::{Arrivals, LeftOut, MotionId, SourceEnd, TargetSource, TimedTarget};
pub use stream::{FileTarget, TargetOrigin, TargetStream, TargetStreamError};
