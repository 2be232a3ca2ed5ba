//! Answers to commands, and telemetry.

use plumb_protocol::frame::FrameError;
use plumb_protocol::message::*;

use super::super::event::{Delivery, TICK, Ticked};
use crate::campaign::Outcome;

/// Each command is answered once, with its id: a Hello by a Hello, an accepted position not at
/// all, an accepted Store later. Nothing else is answered, but for intact frames that are no
/// command.
pub(super) const ANSWERED: &str = "every command is answered once";
/// Before a matching Hello nothing is accepted but Stop and Bootloader.
pub(super) const GREETED: &str = "no command before a matching Hello";
/// Telemetry comes every 100 ms once a host was greeted, whatever else comes.
pub(super) const TELEMETRY: &str = "telemetry every 100 ms";

/// A request that is repeated, with its id and content, is accepted again and not carried out
/// again.
pub(super) const REPEATED: &str = "a repeated request is carried out once";

/// Telemetry and fault reports name the Configure, and the Target or Hold, that are in force.
pub(super) const NAMED: &str = "telemetry names its configuration and target";

/// Longest time between two telemetries, with a tick's slack, µs.
const TELEMETRY_US: u64 = 100_000 + TICK;

/// Checker of [`ANSWERED`], [`GREETED`] and [`REPEATED`].
#[derive(Debug, Clone, Default)]
pub(super) struct Answers {
    greeted: bool,
}

impl Answers {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let holds = match delivery.message {
            Err(FrameError::Malformed) => {
                delivery.answer_count() == 1
                    && delivery.answers(0).all(|refusal| refusal == Some(Refusal::Malformed))
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
        let Some(ToBoard { command, .. }) = delivery.accepted() else { return };
        if let Command::Hello(hello) = command {
            self.greeted = hello == Hello::OURS;
        } else {
            let always = matches!(command, Command::Stop | Command::Bootloader);
            outcome.check(self.greeted || always, GREETED, || format!("{command:?}"));
        }
    }

    /// Checks that a tick answers nothing.
    pub(super) fn ticked(&self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let other =
            |reply: &FromBoard| !matches!(reply, FromBoard::Telemetry(_) | FromBoard::Fault(_));
        let answers = ticked.replies.iter().any(other);
        outcome.check(!answers, ANSWERED, || format!("in a tick: {:?}", ticked.replies));
    }
}

/// Whether the replies are those that this command must have.
fn answered(delivery: &Delivery<'_>, message: &ToBoard) -> bool {
    let count = delivery.answer_count();
    let own = delivery.answers(message.id).count();
    let refused = delivery.answers(message.id).flatten().next().is_some();
    match message.command {
        Command::Hello(hello) => count == 0 && greeted(delivery.replies, message.id, hello),
        Command::Position(_) => count == own && (count == 0 || (count == 1 && refused)),
        Command::Store => count == own && count <= 1,
        _ => count == 1 && own == 1,
    }
}

fn greeted(replies: &[FromBoard], id: u16, hello: Hello) -> bool {
    let matches = hello == Hello::OURS;
    let named = |reply: &&FromBoard| matches!(reply, FromBoard::Hello(board) if board.id == id && board.accepted == matches);
    let started = replies.iter().filter(|reply| matches!(reply, FromBoard::Started(_))).count();
    replies.iter().filter(named).count() == 1 && started == usize::from(matches)
}

/// Checker of [`TELEMETRY`].
#[derive(Debug, Clone, Default)]
pub(super) struct Telemetry {
    greeted: bool,
    /// When it came last, or the host was greeted, µs.
    told: u64,
}

impl Telemetry {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>) {
        self.hear(delivery.replies);
        if let Ok(ToBoard { command: Command::Hello(hello), .. }) = delivery.message {
            if !self.greeted {
                self.told = self.told.max(delivery.at);
            }
            self.greeted = hello == Hello::OURS;
        }
    }

    /// Takes note of the telemetry in what the board said.
    pub(super) fn hear(&mut self, replies: &[FromBoard]) {
        for reply in replies {
            if let FromBoard::Telemetry(telemetry) = reply {
                self.told = self.told.max(telemetry.time.0);
            }
        }
    }

    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        self.hear(ticked.replies);
        let gap = ticked.now.saturating_sub(self.told);
        let holds = !self.greeted || gap <= TELEMETRY_US;
        outcome
            .check(holds, TELEMETRY, || format!("none for {gap} µs in {:?}", ticked.after.state));
    }
}

/// Checker of [`NAMED`].
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    /// The id of the last Configure that was carried out since the last matching Hello.
    configuration: Option<u16>,
    /// The id of the last Target or Hold that was carried out since then.
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
                Command::Target(_) | Command::Hold => self.target = Some(id),
                _ => {}
            }
        }
        self.hear(delivery.replies, outcome);
    }

    /// Checks the names in what the board said. A state that has no target has no name of one.
    pub(super) fn hear(&self, replies: &[FromBoard], outcome: &mut Outcome) {
        for reply in replies {
            let holds = match reply {
                FromBoard::Telemetry(telemetry) => {
                    let seeking = matches!(telemetry.state, State::Seeking | State::Holding);
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
