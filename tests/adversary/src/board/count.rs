//! Counts of what a run exercises.

use plumb_protocol::message::*;

use super::event::{Delivery, Ticked};
use crate::campaign::{Outcome, Tally};

/// Counts a frame and its answer.
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

/// Counts the refusals and faults in the board's messages.
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

/// Returns the name of a refusal or fault without its data, except for the configuration's field.
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
        Command::Diagnose => "Diagnose",
        Command::Measure => "Measure",
        Command::TestFlash => "TestFlash",
        Command::Store => "Store",
        Command::Home => "Home",
        Command::Follow(_) => "Follow",
        Command::Wire(_) => "Wire",
        Command::Prior(_) => "Prior",
        Command::Rates(_) => "Rates",
        Command::Pen(_) => "Pen",
    }
}

/// Number of ticks of a run, in total and by activity.
#[derive(Debug, Default)]
pub(super) struct TickCounts {
    pub(super) ticks: u64,
    moving: u64,
    seeking: u64,
    holding: u64,
    /// Moving in `Ready`.
    jogging: u64,
    /// Seeking, with two motors.
    seeking_in_plane: u64,
    /// Holding, with two motors.
    holding_in_plane: u64,
}

impl TickCounts {
    /// Counts a tick of a rig, which has two motors if it `is_planar`.
    pub(super) fn record(&mut self, ticked: &Ticked<'_>, is_planar: bool) {
        let state = ticked.after.state;
        self.ticks += 1;
        self.moving += u64::from(ticked.pulses());
        self.seeking += u64::from(state == State::Seeking);
        self.holding += u64::from(state == State::Holding);
        self.jogging += u64::from(state == State::Jogging);
        self.seeking_in_plane += u64::from(is_planar && state == State::Seeking);
        self.holding_in_plane += u64::from(is_planar && state == State::Holding);
    }

    /// Adds the counts to the tally of the campaign.
    pub(super) fn add_to(&self, tally: &mut Tally, has_twin: bool) {
        tally.add("ticks", self.ticks);
        tally.add("ticks moving", self.moving);
        tally.add("ticks seeking", self.seeking);
        tally.add("ticks holding", self.holding);
        tally.add("ticks jogging", self.jogging);
        tally.add("ticks seeking in a plane", self.seeking_in_plane);
        tally.add("ticks holding in a plane", self.holding_in_plane);
        tally.add("ticks with a twin", if has_twin { self.ticks } else { 0 });
    }
}
