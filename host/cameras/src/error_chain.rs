//! Message of an error with its causes.

use std::error::Error;
use std::fmt;

/// Error with its causes: displays the messages of the error and of each
/// [`source`](Error::source) below it, joined by ": ". No message of Plumb contains that of its
/// source.
#[derive(Debug, Clone, Copy)]
pub struct ErrorChain<'a>(pub &'a dyn Error);

impl fmt::Display for ErrorChain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)?;
        std::iter::successors(self.0.source(), |&cause| cause.source())
            .try_for_each(|cause| write!(f, ": {cause}"))
    }
}

#[cfg(test)]
mod tests {
    use thiserror::Error;

    use super::*;

    #[derive(Debug, Error)]
    #[error("it is busy")]
    struct Busy;

    #[derive(Debug, Error)]
    #[error("the camera cannot be opened")]
    struct NotOpened(#[source] Busy);

    #[derive(Debug, Error)]
    #[error("the run failed")]
    struct Broken(#[source] NotOpened);

    #[test]
    fn the_messages_of_all_causes_are_joined() {
        assert_eq!(ErrorChain(&Busy).to_string(), "it is busy");
        assert_eq!(
            ErrorChain(&Broken(NotOpened(Busy))).to_string(),
            "the run failed: the camera cannot be opened: it is busy"
        );
    }
}
