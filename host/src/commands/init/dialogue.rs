//! Questions on standard error, answers from standard input.

use std::io::{BufRead, Write};

use thiserror::Error;

/// End of a dialogue before its last answer.
#[derive(Debug, Error)]
pub(super) enum DialogueError {
    /// The input ended.
    #[error(
        "the input ended before the last answer (Ctrl-D?): no file was written. Answer all \
         questions, or take the defaults with --yes"
    )]
    Ended,
    /// The input cannot be read, or the questions cannot be written.
    #[error("the questions cannot be asked: no file was written")]
    Io(#[from] std::io::Error),
}

/// Dialogue with a person, or none.
pub(super) struct Dialogue<'a> {
    input: Box<dyn BufRead + 'a>,
    output: Box<dyn Write + 'a>,
    /// Whether questions are asked. Without them each answer is its default.
    is_interactive: bool,
}

impl<'a> Dialogue<'a> {
    /// Creates a dialogue. Without `is_interactive` each answer is its default.
    pub(super) fn new(
        input: impl BufRead + 'a,
        output: impl Write + 'a,
        is_interactive: bool,
    ) -> Self {
        Self { input: Box::new(input), output: Box::new(output), is_interactive }
    }

    /// Returns whether questions are asked.
    pub(super) fn is_interactive(&self) -> bool {
        self.is_interactive
    }

    /// Writes a line to the person.
    pub(super) fn tell(&mut self, line: &str) -> Result<(), DialogueError> {
        Ok(writeln!(self.output, "{line}")?)
    }

    /// Returns the value of an option, or else the answer to `question`, as [`ask`](Self::ask).
    pub(super) fn given_or_ask<T>(
        &mut self,
        given: Option<T>,
        question: &str,
        default: &str,
        parse: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, DialogueError> {
        given.map_or_else(|| self.ask(question, default, parse), Ok)
    }

    /// Asks `question` until `parse` accepts the answer. An empty answer is `default`.
    ///
    /// # Errors
    /// Where the input ends or cannot be read.
    pub(super) fn ask<T>(
        &mut self,
        question: &str,
        default: &str,
        parse: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, DialogueError> {
        loop {
            let answer = self.answer(question, default)?;
            match parse(&answer) {
                Ok(value) => return Ok(value),
                Err(reason) => self.tell(&format!("  {reason}"))?,
            }
        }
    }

    fn answer(&mut self, question: &str, default: &str) -> Result<String, DialogueError> {
        if !self.is_interactive {
            return Ok(default.to_owned());
        }
        write!(self.output, "{question} [{default}]: ")?;
        self.output.flush()?;
        let mut line = String::new();
        if self.input.read_line(&mut line)? == 0 {
            writeln!(self.output)?;
            return Err(DialogueError::Ended);
        }
        let answer = line.trim();
        Ok(if answer.is_empty() { default } else { answer }.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str) -> Result<u8, String> {
        text.parse().map_err(|_| "must be a number".to_owned())
    }

    #[test]
    fn a_wrong_answer_is_asked_again_and_an_empty_one_is_the_default() {
        let mut output = Vec::new();
        let mut dialogue = Dialogue::new("x\n 7 \n\n".as_bytes(), &mut output, true);
        assert_eq!(dialogue.ask("How many?", "3", number).unwrap(), 7);
        assert_eq!(dialogue.ask("How many?", "3", number).unwrap(), 3);
        drop(dialogue);
        let text = String::from_utf8(output).unwrap();
        assert_eq!(text.matches("How many? [3]: ").count(), 3);
        assert_eq!(text.matches("must be a number").count(), 1);
    }

    #[test]
    fn an_input_that_ends_is_an_error_and_without_questions_nothing_is_read() {
        let mut dialogue = Dialogue::new("7".as_bytes(), Vec::new(), true);
        assert_eq!(dialogue.ask("How many?", "3", number).unwrap(), 7);
        let ended = dialogue.ask("How many?", "3", number);
        assert!(matches!(ended, Err(DialogueError::Ended)), "{ended:?}");
        let mut silent = Dialogue::new("".as_bytes(), Vec::new(), false);
        assert_eq!(silent.ask("How many?", "3", number).unwrap(), 3);
    }
}
