//! Progress of a long command: a line on the terminal, renewed in place.

use std::fmt;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use crate::cli::print::{is_quiet, renew, renew_line};

/// Returns whether progress is shown: standard error is a terminal, and `--quiet` is absent.
pub(crate) fn is_shown() -> bool {
    stderr().is_terminal() && !is_quiet()
}

/// Prints a line, in place of the line of progress where there is one, which comes again with the
/// next text.
pub(crate) fn tell_above(text: fmt::Arguments<'_>) {
    if is_shown() {
        renew_line(text);
    } else {
        tell!("{text}");
    }
}

/// Line of progress. Dropping it removes the line.
pub(crate) struct ProgressLine {
    is_on: bool,
    /// Time of the last text; `None` where the terminal has none.
    shown: Option<Instant>,
}

impl ProgressLine {
    /// Least time between two texts: a reader sees 10 a second.
    const INTERVAL: Duration = Duration::from_millis(100);

    /// Returns a line without a text, which stays empty where `is_on` is not set.
    pub(crate) fn shown_if(is_on: bool) -> Self {
        Self { is_on, shown: None }
    }

    /// Shows `text` at `now` in place of the text before. Leaves it out where that is too new.
    pub(crate) fn show(&mut self, text: fmt::Arguments<'_>, now: Instant) {
        if self.is_due(now) {
            renew(text);
        }
    }

    /// Returns whether a text is shown at `now`, and notes it.
    fn is_due(&mut self, now: Instant) -> bool {
        let is_new = self.shown.is_some_and(|shown| now - shown < Self::INTERVAL);
        if !self.is_on || is_new {
            return false;
        }
        self.shown = Some(now);
        true
    }

    /// Removes the text: a message follows.
    pub(crate) fn clear(&mut self) {
        if self.shown.take().is_some() {
            renew(format_args!(""));
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_renewed_ten_times_a_second_at_most() {
        let begin = Instant::now();
        let shown = |is_on| {
            let mut line = ProgressLine::shown_if(is_on);
            (0..100).filter(|n| line.is_due(begin + *n * Duration::from_millis(10))).count()
        };
        assert_eq!((shown(true), shown(false)), (10, 0));
    }

    #[test]
    fn a_text_after_a_message_is_shown_at_once() {
        let (mut line, now) = (ProgressLine::shown_if(true), Instant::now());
        assert!(line.is_due(now) && !line.is_due(now));
        line.clear();
        assert!(line.is_due(now));
    }
}
