//! Messages of a run for people: events, and warnings of the motor drivers.

use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::board_report::{NO_WARNINGS, driver_warnings, warning_advice};
use plumb_runtime::observer::{EventKind, EventRecord, FrameRecord, Observer, RunEvent, Tone};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand};

use crate::cli::print::{is_quiet, tell_above};

/// Messages of a run.
pub(crate) struct Messages {
    /// Whether the run goes on after a fault, for its operator.
    is_operated: bool,
    /// The last fault that was printed, with its advice.
    pub(crate) told: Option<BoardFault>,
    /// The fault in which the board stands.
    pub(crate) standing: Option<BoardFault>,
    /// The last warnings of drivers on a UART that were printed; [`NO_WARNINGS`] before the first.
    warnings: String,
}

impl Messages {
    pub(crate) fn new(is_operated: bool) -> Self {
        Self { is_operated, told: None, standing: None, warnings: NO_WARNINGS.to_owned() }
    }

    /// Notes a fault, and that one was cleared.
    fn note_fault(&mut self, event: &RunEvent) {
        use OperatorCommand::ClearFault;

        match event {
            RunEvent::Command {
                command: ClearFault, outcome: CommandOutcome::Accepted, ..
            } => {
                self.standing = None;
            }
            event => self.standing = event.fault().or(self.standing),
        }
    }
}

impl Observer for Messages {
    /// Prints the warnings of the drivers where they have changed.
    fn frame(&mut self, record: &FrameRecord) {
        let drivers = record.board.as_ref().and_then(|board| board.drivers);
        let Some(drivers) = drivers else { return };
        let warnings = driver_warnings(&drivers);
        if warnings == self.warnings {
            return;
        }
        let advice = warning_advice(&drivers).map(|advice| format!(" ({advice})"));
        let advice = advice.unwrap_or_default();
        tell_above(format_args!("warnings of the motor drivers: {warnings}{advice}"));
        self.warnings = warnings;
    }

    fn event(&mut self, record: &EventRecord) {
        self.note_fault(&record.event);
        if record.event.fault().is_some() && !self.is_operated {
            // It ends the run, and the result has it.
            return;
        }
        let Some(text) = text(&record.event) else { return };
        self.told = record.event.fault().or(self.told);
        if !is_quiet() || record.event.tone() == Tone::Bad {
            tell_above(format_args!("{text}"));
        }
    }
}

/// Returns the text of an event for the terminal; `None` where the result of the run or the
/// progress line has it.
fn text(event: &RunEvent) -> Option<String> {
    if let Some(fault) = event.fault() {
        return Some(format!("the board has stopped by itself: {fault}. {}", fault.advice()));
    }
    match event.kind() {
        EventKind::Targets | EventKind::Stop | EventKind::Doubt => Some(event.to_string()),
        EventKind::Command if event.tone() == Tone::Bad => Some(event.to_string()),
        _ => None,
    }
}
