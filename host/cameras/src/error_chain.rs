//! Message of an error with its causes.

use std::error::Error;
use std::fmt;

/// Error with its causes: displays the messages of the chain, joined by ": ". A message that an
/// error above already contains is left out, since some libraries repeat their causes.
#[derive(Debug, Clone, Copy)]
pub struct ErrorChain<'a>(pub &'a dyn Error);

impl fmt::Display for ErrorChain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = self.0.to_string();
        let mut source = self.0.source();
        while let Some(cause) = source {
            let message = cause.to_string();
            if !text.contains(&message) {
                text = format!("{text}: {message}");
            }
            source = cause.source();
        }
        f.write_str(&text)
    }
}

#[cfg(test)]
mod tests {
    use thiserror::Error;

    use super::*;

    #[derive(Debug, Error)]
    #[error("it is busy")]
    struct Cause;

    #[test]
    fn causes_are_displayed_once() {
        #[derive(Debug, Error)]
        #[error("the camera cannot be opened")]
        struct Own(#[source] Cause);
        #[derive(Debug, Error)]
        #[error("the camera cannot be opened: {0}")]
        struct Repeated(#[source] Cause);
        for error in [&Own(Cause) as &dyn Error, &Repeated(Cause)] {
            assert_eq!(ErrorChain(error).to_string(), "the camera cannot be opened: it is busy");
        }
    }
}
