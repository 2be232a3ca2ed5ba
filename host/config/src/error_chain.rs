//! Message of an error with its causes.

use std::error::Error;
use std::{fmt, io};

/// What the system means by "File too large".
const FILE_SIZE_LIMIT: &str = "the limit of a file's size is reached: that of this process \
                               (`ulimit -f` in the shell), or that of the file system";

/// Error with its causes: displays the messages of the error and of each
/// [`source`](Error::source) below it, joined by ": ". No message of Plumb contains that of its
/// source.
#[derive(Debug, Clone, Copy)]
pub struct ErrorChain<'a>(pub &'a (dyn Error + 'static));

impl<'a> ErrorChain<'a> {
    /// Returns the error, and then each source below it.
    pub fn errors(self) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
        std::iter::successors(Some(self.0), |&cause| cause.source())
    }
}

impl fmt::Display for ErrorChain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&words(self.0))?;
        self.errors().skip(1).try_for_each(|cause| write!(f, ": {}", words(cause)))?;
        if self.errors().any(is_file_size_limit) {
            write!(f, "; {FILE_SIZE_LIMIT}")?;
        }
        Ok(())
    }
}

/// Returns the message of an error. The number of an error of the system, " (os error 2)", is left
/// out behind its words.
fn words(error: &dyn Error) -> String {
    let text = error.to_string();
    match text.rsplit_once(" (os error ") {
        Some((words, number)) if number.ends_with(')') => words.to_owned(),
        _ => text,
    }
}

/// Returns whether `error` is that of a write beyond the limit of a file's size.
fn is_file_size_limit(error: &(dyn Error + 'static)) -> bool {
    let error = error.downcast_ref::<io::Error>();
    error.is_some_and(|error| error.kind() == io::ErrorKind::FileTooLarge)
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

    #[derive(Debug, Error)]
    #[error("run.csv")]
    struct Unwritten(#[source] io::Error);

    #[test]
    fn the_limit_of_a_files_size_is_explained() {
        let message = |kind: io::ErrorKind| ErrorChain(&Unwritten(kind.into())).to_string();
        let limit = message(io::ErrorKind::FileTooLarge);
        assert_eq!(limit, format!("run.csv: file too large; {FILE_SIZE_LIMIT}"));
        assert_eq!(message(io::ErrorKind::StorageFull), "run.csv: no storage space");
    }

    #[test]
    fn an_error_of_the_system_is_told_in_words_without_its_number() {
        let absent = Unwritten(io::Error::from_raw_os_error(2));
        assert_eq!(ErrorChain(&absent).to_string(), "run.csv: No such file or directory");
    }
}
