//! Messages of the worker thread.

use crate::error::OpenniError;
use crate::mailbox::{Message, MessageKind};
use crate::picture::Pair;
use crate::settings::Opened;

/// Message about an open camera.
#[derive(Debug)]
pub(crate) enum Event {
    /// The next pair of pictures.
    Pair(Pair),
    /// Pictures are lost. The camera goes on.
    Problem(OpenniError),
    /// The camera or recording is over: the last message.
    Over(Result<(), OpenniError>),
}

impl Message for Event {
    fn kind(&self) -> MessageKind {
        match self {
            Self::Pair(_) => MessageKind::Content,
            Self::Problem(_) => MessageKind::Problem,
            Self::Over(_) => MessageKind::End,
        }
    }
}

impl Message for Result<Opened, OpenniError> {
    fn kind(&self) -> MessageKind {
        MessageKind::Content
    }
}
