//! Progress of a run on the terminal: the time, the target, the ball and the board's state.

use plumb_cameras::record::Overflow;
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};

use crate::cli::print::{is_shown, message, renew};

/// Progress lines that may wait for the terminal.
const PROGRESS_CAPACITY: usize = 2;

/// Progress line on a terminal, renewed in place.
pub(crate) struct TerminalLine {
    /// Number of targets of the run; `None` where it has no list of them.
    targets: Option<usize>,
    /// Number of the present target, from 1; 0 before the first.
    number: usize,
}

impl TerminalLine {
    /// Returns the line of a frame, of about 80 characters.
    fn text(&self, record: &FrameRecord) -> String {
        let goal = match record.path {
            Some(path) => format!("from the path, speed {:3.0} %", path.pace * 100.0),
            None => "to go".to_owned(),
        };
        let to_go = record.error().map(|error| format!(", {:6.1} mm {goal}", error * 1e3));
        let to_go = to_go.unwrap_or_default();
        let ball = match record.position() {
            Some(p) => format!("ball ({:.3}, {:.3}, {:.3}) m{to_go}", p.x, p.y, p.z),
            None => "no ball".to_owned(),
        };
        let board = record.board_state().map(|state| state.to_string()).unwrap_or_default();
        format!("{:7.2} s  {}{ball}  {board}", record.time, self.target())
    }

    /// Returns the present target among those of the run.
    fn target(&self) -> String {
        match (self.number, self.targets) {
            (0, _) => String::new(),
            // An operator may set more targets than the list has.
            (number, Some(count)) if number <= count => format!("target {number} of {count}  "),
            (number, _) => format!("target {number}  "),
        }
    }
}

impl Observer for TerminalLine {
    fn frame(&mut self, record: &FrameRecord) {
        renew(format_args!("{}", self.text(record)));
    }

    fn event(&mut self, record: &EventRecord) {
        if let RunEvent::TargetSet { number, .. } = record.event {
            self.number = number + 1;
        }
    }
}

/// Progress on standard error; `None` where that is no terminal. Lines that the terminal has no
/// time for are left out.
pub(crate) type Progress = Option<BoundedObserver<TerminalLine>>;

/// Starts the progress of a run through so many targets; `None` where it has no list of them.
pub(crate) fn start(targets: Option<usize>) -> std::io::Result<Progress> {
    let settings = QueueSettings {
        name: "progress",
        capacity: PROGRESS_CAPACITY,
        overflow: Overflow::Drop,
        with_frames: false,
    };
    let line = || BoundedObserver::new(TerminalLine { targets, number: 0 }, settings);
    is_shown().then(line).transpose()
}

/// Ends the line.
pub(crate) fn close(progress: Progress) {
    if let Some(queue) = progress {
        let _failed = queue.close();
        message(format_args!("\n"));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_protocol::message::State;

    use super::*;

    /// Returns a frame without a ball, at 4.1 s.
    fn record() -> FrameRecord {
        FrameRecord {
            number: 123,
            time: 4.1,
            target: Some(Point3::origin()),
            state: Some(State::Seeking),
            ..FrameRecord::default()
        }
    }

    fn set(number: usize) -> EventRecord {
        let event = RunEvent::TargetSet { number, target: Point3::origin() };
        EventRecord { time: 0.0, event }
    }

    #[test]
    fn the_line_has_the_target_among_all_and_the_state_of_the_board() {
        let mut line = TerminalLine { targets: Some(2), number: 0 };
        assert_eq!(line.text(&record()), "   4.10 s  no ball  seeking");
        line.event(&set(1));
        assert_eq!(line.text(&record()), "   4.10 s  target 2 of 2  no ball  seeking");
        // One of the operator.
        line.event(&set(2));
        assert_eq!(line.text(&record()), "   4.10 s  target 3  no ball  seeking");
    }

    #[test]
    fn targets_that_are_repeated_or_move_have_no_number_of_all() {
        let mut line = TerminalLine { targets: None, number: 0 };
        line.event(&set(6));
        assert_eq!(line.text(&record()), "   4.10 s  target 7  no ball  seeking");
    }
}
