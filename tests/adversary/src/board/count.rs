//! Counts of what was exercised.

use plumb_protocol::message::*;

use super::event::Delivery;
use crate::campaign::Outcome;

/// Counts what was received and how it was answered.
pub(super) fn count_delivery(delivery: &Delivery<'_>, outcome: &mut Outcome) {
    count_replies(delivery.replies, outcome);
    let Ok(message) = delivery.message else {
        return outcome.tally.count("frames damaged");
    };
    outcome.tally.add("repeated requests", delivery.repeated.into());
    let name = name(&message.command);
    let answer = if delivery.accepted().is_some() { "accepted" } else { "refused" };
    outcome.tally.count(&format!("{name} {answer}"));
}

/// Counts the refusals and faults in what the board said.
pub(super) fn count_replies(replies: &[FromBoard], outcome: &mut Outcome) {
    for reply in replies {
        match reply {
            FromBoard::Answer(Answer { refusal: Some(refusal), .. }) => {
                outcome.tally.count(&format!("refused {}", variant(refusal)));
            }
            FromBoard::Fault(report) => {
                outcome.tally.count(&format!("fault {}", variant(&report.fault)));
            }
            _ => {}
        }
    }
}

/// Returns the name of a refusal or fault without what it carries, but for the configuration's
/// field.
fn variant(value: &impl std::fmt::Debug) -> String {
    let text = format!("{value:?}");
    match text.split_once('(') {
        Some((name, _)) if name != "Config" => name.to_owned(),
        _ => text,
    }
}

fn name(command: &Command) -> &'static str {
    match command {
        Command::Hello(_) => "Hello",
        Command::Stop => "Stop",
        Command::Bootloader => "Bootloader",
        Command::Configure(_) => "Configure",
        Command::Position(_) => "Position",
        Command::Target(_) => "Target",
        Command::Jog(_) => "Jog",
        Command::Hold => "Hold",
        Command::ClearFault => "ClearFault",
        Command::Status => "Status",
        Command::Store => "Store",
    }
}
