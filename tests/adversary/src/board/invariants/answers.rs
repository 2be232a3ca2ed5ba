//! Answers to commands, and telemetry.

use plumb_protocol::MOTORS;
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::*;

use super::super::event::{Delivery, TICK, Ticked};
use super::limits::Limits;
use crate::campaign::Outcome;

/// Each command has one answer, with its id: a Hello for a Hello, none for an accepted position, a
/// later one for an accepted Store or TestFlash, one in the next tick for a Diagnose or a Measure.
/// Apart from that, only intact frames that are not commands have an answer.
pub(super) const ANSWERED: &str = "every command is answered once";
/// Before a matching Hello, only Stop and Bootloader are accepted.
pub(super) const GREETED: &str = "no command before a matching Hello";
/// After a Hello, telemetry is sent every 100 ms, independent of other messages.
pub(super) const TELEMETRY: &str = "telemetry every 100 ms";

/// Telemetry has an entry for each motor of the rig; without a configuration, for each that the
/// board can step.
pub(super) const ENTRIES: &str = "telemetry has an entry for each motor";

/// A repeated request, with the same id and content, is accepted again and not executed again.
pub(super) const REPEATED: &str = "a repeated request is carried out once";

/// Telemetry and fault reports have the ids of the current Configure, and of the current Target or
/// Hold.
pub(super) const NAMED: &str = "telemetry names its configuration and target";

/// Maximum time between two telemetries, with one tick of tolerance, µs.
const TELEMETRY_US: u64 = 100_000 + TICK;

/// Checker of [`ANSWERED`], [`GREETED`] and [`REPEATED`].
#[derive(Debug, Clone, Default)]
pub(super) struct Answers {
    greeted: bool,
    /// Id of the last accepted Diagnose, until its answer.
    diagnosis: Option<u16>,
    /// Id of the last accepted Measure, until its answer.
    measurement: Option<u16>,
}

impl Answers {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let holds = match delivery.message {
            Err(FrameError::UnknownCommand { id }) => {
                delivery.answer_count() == 1
                    && delivery.answers(id).all(|refusal| refusal == Some(Refusal::Malformed))
            }
            Err(_) => delivery.answer_count() == 0,
            Ok(message) => answered(delivery, &message),
        };
        outcome
            .check(holds, ANSWERED, || format!("{:?}: {:?}", delivery.message, delivery.replies));
        if delivery.repeated {
            let same = delivery.before == delivery.after && delivery.accepted().is_some();
            outcome.check(same, REPEATED, || format!("{delivery:?}"));
        }
        let Some(ToBoard { id, command }) = delivery.accepted() else { return };
        match command {
            Command::Diagnose => self.diagnosis = Some(id),
            Command::Measure => self.measurement = Some(id),
            _ => {}
        }
        if let Command::Hello(hello) = command {
            self.greeted = hello == Hello::OURS;
        } else {
            let always = matches!(command, Command::Stop | Command::Bootloader);
            outcome.check(self.greeted || always, GREETED, || format!("{command:?}"));
        }
    }

    /// Checks that a tick has no answer, and asks the chip for its counts where a Diagnose waits.
    pub(super) fn ticked(&self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let asked = ticked.requests.unwrap_or_default();
        let holds = asked.diagnose == self.diagnosis.is_some()
            && asked.measure == self.measurement.is_some();
        outcome.check(holds, ANSWERED, || format!("{:?} for {self:?}", ticked.requests));
        let other = |reply: &FromBoard| {
            !matches!(reply, FromBoard::Telemetry(_) | FromBoard::Fault(_) | FromBoard::Drivers(_))
        };
        let answers = ticked.replies.iter().any(other);
        outcome.check(!answers, ANSWERED, || format!("in a tick: {:?}", ticked.replies));
    }
}

/// Checks of the chip's answers.
impl Answers {
    /// Checks the messages after the chip has measured.
    pub(super) fn measured(&mut self, replies: &[FromBoard], outcome: &mut Outcome) {
        let wanted = self.measurement.take();
        let holds = match replies {
            [FromBoard::Measurement(measurement)] => Some(measurement.id) == wanted,
            _ => false,
        };
        outcome.check(holds, ANSWERED, || format!("{replies:?} for {wanted:?}"));
    }

    /// Checks the messages after the chip has told its counts.
    pub(super) fn diagnosed(&mut self, replies: &[FromBoard], outcome: &mut Outcome) {
        let wanted = self.diagnosis.take();
        let holds = match replies {
            [FromBoard::Diagnostics(diagnostics)] => Some(diagnostics.id) == wanted,
            _ => false,
        };
        outcome.check(holds, ANSWERED, || format!("{replies:?} for {wanted:?}"));
    }
}

/// Returns whether the replies are those that this command requires.
fn answered(delivery: &Delivery<'_>, message: &ToBoard) -> bool {
    let count = delivery.answer_count();
    let own = delivery.answers(message.id).count();
    let refused = delivery.answers(message.id).flatten().next().is_some();
    match message.command {
        Command::Hello(hello) => count == 0 && greeted(delivery.replies, message.id, hello),
        Command::Position(_) => count == own && (count == 0 || (count == 1 && refused)),
        Command::Store | Command::TestFlash => count == own && count <= 1,
        Command::Diagnose | Command::Measure => {
            count == own && (count == 0 || (count == 1 && refused))
        }
        _ => count == 1 && own == 1,
    }
}

fn greeted(replies: &[FromBoard], id: u16, hello: Hello) -> bool {
    let matches = hello == Hello::OURS;
    let answers = |reply: &&FromBoard| match reply {
        FromBoard::Hello(board) => board.id == id && board.accepted == matches,
        _ => false,
    };
    let started = replies.iter().filter(|reply| matches!(reply, FromBoard::Started(_))).count();
    replies.iter().filter(answers).count() == 1 && started == usize::from(matches)
}

/// Checks the number of entries of the telemetry in the board's messages.
pub(super) fn check_entries(replies: &[FromBoard], limits: Option<&Limits>, outcome: &mut Outcome) {
    let count = limits.map_or(MOTORS, |limits| limits.count);
    for reply in replies {
        let FromBoard::Telemetry(telemetry) = reply else { continue };
        let is_told = telemetry.tensions.is_none_or(|tensions| tensions.len() == count);
        let holds = is_told && telemetry.motors.len() == count && telemetry.rates.len() == count;
        outcome.check(holds, ENTRIES, || format!("not {count}: {telemetry:?}"));
    }
}

/// Checker of [`TELEMETRY`].
#[derive(Debug, Clone, Default)]
pub(super) struct Telemetry {
    greeted: bool,
    /// Time of the last telemetry, or of Hello, µs.
    requests: u64,
}

impl Telemetry {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>) {
        self.hear(delivery.replies);
        if let Ok(ToBoard { command: Command::Hello(hello), .. }) = delivery.message {
            if !self.greeted {
                self.requests = self.requests.max(delivery.at);
            }
            self.greeted = hello == Hello::OURS;
        }
    }

    /// Records the telemetry in the board's messages.
    pub(super) fn hear(&mut self, replies: &[FromBoard]) {
        for reply in replies {
            if let FromBoard::Telemetry(telemetry) = reply {
                self.requests = self.requests.max(telemetry.time.0);
            }
        }
    }

    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        self.hear(ticked.replies);
        let gap = ticked.now.saturating_sub(self.requests);
        let holds = !self.greeted || gap <= TELEMETRY_US;
        outcome
            .check(holds, TELEMETRY, || format!("none for {gap} µs in {:?}", ticked.after.state));
    }
}

/// Checker of [`NAMED`].
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    /// Id of the last executed Configure since the last matching Hello.
    configuration: Option<u16>,
    /// Id of the last executed Target, Hold or Follow since then.
    target: Option<u16>,
}

impl Names {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        if let Some(ToBoard { id, command }) = delivery.accepted()
            && !delivery.repeated
        {
            match command {
                Command::Hello(hello) if hello == Hello::OURS => *self = Self::default(),
                Command::Configure(_) => self.configuration = Some(id),
                Command::Target(_) | Command::Hold | Command::Follow(_) => self.target = Some(id),
                _ => {}
            }
        }
        self.hear(delivery.replies, outcome);
    }

    /// Checks the ids in the board's messages. A state without a target has no target id.
    pub(super) fn hear(&self, replies: &[FromBoard], outcome: &mut Outcome) {
        for reply in replies {
            let holds = match reply {
                FromBoard::Telemetry(telemetry) => {
                    let seeking = matches!(
                        telemetry.state,
                        State::Seeking | State::Holding | State::Following
                    );
                    telemetry.configuration == self.configuration
                        && telemetry.target == self.target.filter(|_| seeking)
                }
                FromBoard::Fault(report) => report.configuration == self.configuration,
                _ => true,
            };
            outcome.check(holds, NAMED, || format!("{self:?}: {reply:?}"));
        }
    }
}
