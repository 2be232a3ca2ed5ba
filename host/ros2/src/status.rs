//! Status of a run for the diagnostics.

use std::time::{Duration, Instant, UNIX_EPOCH};

use nalgebra::Point3;
use plumb_protocol::MotorList;
use plumb_protocol::message::{DriverReading, State};
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::board_report::driver_warnings;
use plumb_runtime::observer::{FrameRecord, RunEvent};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand, Stop};
use plumb_runtime::run::Summary;

use crate::message::diagnostic::{KeyValue, Level};

/// Time without a picture after which the diagnostics report it.
const SILENCE: Duration = Duration::from_secs(1);

/// Level, message and values of a status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Report {
    pub(crate) level: Level,
    pub(crate) message: String,
    pub(crate) values: Vec<KeyValue>,
}

/// Status of a run, from its records and events.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunStatus {
    /// Beginning of the run.
    begin: Option<Instant>,
    /// Whether the control loop has begun: there is a frame or an event.
    has_begun: bool,
    /// State of the board; `None` before its telemetry about a new target.
    state: Option<State>,
    fault: Option<BoardFault>,
    /// Newest readings of the motor drivers; `None` of drivers without a UART.
    drivers: Option<MotorList<DriverReading>>,
    /// The target that the rig drives to, holds or follows.
    present_target: Option<Point3<f64>>,
    /// Whether the present target has moved: it is that of a path or of a moving target.
    has_moved: bool,
    /// Distance of the measured position from the target, metres; `None` without a position.
    error: Option<f64>,
    /// Whether the last picture shows the ball.
    is_ball_seen: bool,
    last_frame: Option<Instant>,
    frames: u64,
    lost: u64,
    last_loss: Option<String>,
    /// Result of the last drive to a target.
    last_leg: Option<String>,
    /// Result of the last command.
    last_command: Option<(Level, String)>,
    /// Number of commands that were refused.
    refused: u64,
    /// Level and message of the run's end.
    ending: Option<(Level, String)>,
}

impl RunStatus {
    /// Returns the status of a run that begins.
    pub(crate) fn new(begin: Instant) -> Self {
        Self { begin: Some(begin), ..Self::default() }
    }

    /// Returns the set point that the rig drives to or holds; `None` where the target moves, which
    /// a set point ends.
    pub(crate) fn present_target(&self) -> Option<Point3<f64>> {
        self.present_target.filter(|_| !self.has_moved)
    }

    /// Returns whether the control loop has begun.
    pub(crate) fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// Notes the record of a frame.
    pub(crate) fn note_frame(&mut self, record: &FrameRecord, now: Instant) {
        self.has_begun = true;
        self.frames += 1;
        self.last_frame = Some(now);
        (self.error, self.is_ball_seen) = (record.error(), record.position().is_some());
        if record.path.is_some() {
            self.has_moved = true;
        }
        if self.has_moved && self.present_target.is_some() {
            self.present_target = record.target;
        }
        let newest = record.board.map(|board| board.state);
        // Telemetry from before a target says nothing about the drive to it.
        self.state = if self.present_target.is_some() { record.state } else { newest };
        if newest.is_some() {
            self.fault = record.board_fault();
            self.drivers = record.board.and_then(|board| board.drivers);
        }
    }

    /// Notes an event.
    pub(crate) fn note_event(&mut self, event: &RunEvent) {
        self.has_begun = true;
        match event {
            RunEvent::TargetSet { target, .. } => {
                (self.present_target, self.state) = (Some(*target), None);
                self.has_moved = false;
            }
            RunEvent::TargetEnded { reason, .. } => {
                if !reason.is_arrival() {
                    self.present_target = None;
                }
                self.fault = reason.fault().or(self.fault);
                self.last_leg = Some(reason.to_string());
            }
            RunEvent::FrameLost { message } => {
                self.lost += 1;
                self.last_loss = Some(message.clone());
            }
            RunEvent::BoardStopped { fault } => {
                self.present_target = None;
                self.fault = Some(*fault);
            }
            RunEvent::Command { command, outcome, .. } => self.note_command(*command, *outcome),
            _ => {}
        }
    }

    fn note_command(&mut self, command: OperatorCommand, outcome: CommandOutcome) {
        if let CommandOutcome::Refused(refusal) = outcome {
            self.note_refusal(format!("{command}: {refusal}"));
            return;
        }
        match command {
            OperatorCommand::Stop | OperatorCommand::Hold => self.present_target = None,
            OperatorCommand::ClearFault => self.fault = None,
            _ => {}
        }
        self.last_command = Some((Level::Ok, format!("{command}: accepted")));
    }

    /// Notes a refusal of this node or the control loop.
    pub(crate) fn note_refusal(&mut self, message: String) {
        self.refused += 1;
        self.last_command = Some((Level::Warn, message));
    }

    /// Notes the end of the run.
    pub(crate) fn record_end(&mut self, summary: &Summary) {
        let is_well = summary.reached || summary.ending.is_chosen();
        let level = if is_well { Level::Ok } else { Level::Error };
        self.ending = Some((level, format!("the run has ended: {}", summary.ending)));
    }

    /// Returns the report about the run.
    pub(crate) fn run(&self, now: Instant) -> Report {
        let (level, message) = self.run_message(now);
        let mut values =
            vec![KeyValue::new("frames", self.frames), KeyValue::new("lost", self.lost)];
        let mut add = |key, value: Option<String>| {
            values.extend(value.map(|value| KeyValue::new(key, value)));
        };
        add("state", self.state.map(|state| state.to_string()));
        add("target_m", self.present_target.map(|p| format!("{:.3} {:.3} {:.3}", p.x, p.y, p.z)));
        add("error_mm", self.error.map(|error| format!("{:.1}", error * 1e3)));
        add("driver_warnings", self.drivers.map(|drivers| driver_warnings(&drivers)));
        add("last_target", self.last_leg.clone());
        add("last_loss", self.last_loss.clone());
        add("advice", self.fault.map(|fault| fault.advice().to_owned()));
        Report { level, message, values }
    }

    fn run_message(&self, now: Instant) -> (Level, String) {
        if let Some((level, message)) = &self.ending {
            return (*level, message.clone());
        }
        if let Some(fault) = self.fault {
            return (Level::Error, format!("the board has stopped by itself: {fault}"));
        }
        let heard = self.last_frame.or(self.begin).unwrap_or(now);
        let silent = now.saturating_duration_since(heard);
        if silent >= SILENCE {
            return (Level::Error, format!("no picture for {:.0} s", silent.as_secs_f64()));
        }
        if self.last_frame.is_some() && !self.is_ball_seen {
            return (Level::Warn, "the ball is not in view".to_owned());
        }
        let state = self
            .state
            .map_or_else(|| "waiting for the board".to_owned(), |state| state.to_string());
        match &self.drivers {
            Some(drivers) if drivers.iter().any(DriverReading::has_warning) => {
                (Level::Warn, format!("{state}; motor drivers: {}", driver_warnings(drivers)))
            }
            _ => (Level::Ok, state),
        }
    }

    /// Returns the report about the commands. `is_stopped` says whether targets are refused since a
    /// Stop.
    pub(crate) fn commands(&self, is_stopped: bool) -> Report {
        let none = || (Level::Ok, "no command yet".to_owned());
        let (level, message) = self.last_command.clone().unwrap_or_else(none);
        let targets = if is_stopped { "refused since a stop" } else { "accepted" };
        let values =
            vec![KeyValue::new("targets", targets), KeyValue::new("refused", self.refused)];
        Report { level, message, values }
    }
}

/// Returns the report about the Stop in force: with the number that a Resume names.
pub(crate) fn stop_report(stop: Option<&Stop>) -> Report {
    let Some(Stop { number, by, since, refused }) = stop else {
        let message = "no stop is in force".to_owned();
        return Report { level: Level::Ok, message, values: vec![KeyValue::new("number", 0)] };
    };
    // A clock before 1970 is wrong anyway.
    let since = since.duration_since(UNIX_EPOCH).unwrap_or_default();
    let values = vec![
        KeyValue::new("number", number),
        KeyValue::new("by", by),
        KeyValue::new("since_s", format!("{:.3}", since.as_secs_f64())),
        KeyValue::new("refused", refused),
    ];
    Report { level: Level::Warn, message: format!("stopped by {by} (command {number})"), values }
}

#[cfg(test)]
mod tests;
