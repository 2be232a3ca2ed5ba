//! Messages of the board: received, decoded, and noted in the state of the link.

use plumb_protocol::MotorList;
use plumb_protocol::message::DriverReading;
use tracing::{trace, warn};

use super::commands::{Entry, Purpose};
use super::*;
use crate::board_report::driver_warnings;

/// Bytes that one poll takes in at most: 20 s of telemetry.
const MAX_BACKLOG: usize = 1 << 16;

impl<T: Transport> Link<T> {
    /// Receives the messages that have arrived, or arrive within `wait`.
    pub(super) fn listen(&mut self, wait: Duration) -> Result<Vec<FromBoard>, LinkError> {
        let mut bytes = Vec::new();
        self.transport.receive(&mut bytes, wait)?;
        // After a pause of the host more has arrived than one call returns.
        let (mut before, mut received) = (0, Ok(()));
        while bytes.len() > before && bytes.len() < MAX_BACKLOG && received.is_ok() {
            before = bytes.len();
            received = self.transport.receive(&mut bytes, Duration::ZERO);
        }
        let messages = self.decode(&bytes);
        // The last message before a break may be the board's fault.
        received.map(|()| messages)
    }

    /// Decodes and handles the messages that end in `bytes`.
    fn decode(&mut self, bytes: &[u8]) -> Vec<FromBoard> {
        let mut messages = Vec::new();
        for &byte in bytes {
            match self.accumulator.push::<FromBoard>(byte) {
                None => {}
                Some(Ok(message)) => {
                    self.note(&message);
                    messages.push(message);
                }
                Some(Err(_)) => {
                    self.bad_frames += 1;
                    self.evidence.damaged(self.transport.now());
                    debug!(count = self.bad_frames, "a frame from the board is damaged");
                }
            }
        }
        messages
    }

    /// Handles a message of the board.
    fn note(&mut self, message: &FromBoard) {
        match message {
            FromBoard::Telemetry(telemetry) => self.note_telemetry(telemetry),
            FromBoard::Fault(report)
                if report.configuration == self.configuration && report.time >= self.configured =>
            {
                self.note_fault(report.fault);
            }
            FromBoard::Answer(answer) => self.note_answer(answer),
            FromBoard::Started(cause) => {
                debug!(?cause, "the board has started");
                self.start_cause = Some(*cause);
            }
            FromBoard::Provenance(provenance) => {
                debug!(%provenance, "the board's program");
                self.provenance = Some(*provenance);
            }
            FromBoard::Drivers(report) if report.time >= self.configured => {
                self.note_drivers(&report.motors);
            }
            FromBoard::Fault(_)
            | FromBoard::Drivers(_)
            | FromBoard::Hello(_)
            | FromBoard::Diagnostics(_)
            | FromBoard::Measurement(_) => {}
        }
    }

    /// Notes the readings of drivers on a UART. A warning that comes is written to the log.
    fn note_drivers(&mut self, motors: &MotorList<DriverReading>) {
        let warnings = driver_warnings(motors);
        let before = driver_warnings(&self.drivers.unwrap_or_default());
        if warnings != before {
            warn!(%warnings, "the warnings of the motor drivers have changed");
        }
        self.drivers = Some(*motors);
    }

    fn note_telemetry(&mut self, telemetry: &Telemetry) {
        let is_ours = self.configuration.is_some() && telemetry.configuration == self.configuration;
        self.clock.update(telemetry.time, self.transport.now(), is_ours);
        self.evidence.board_count(telemetry.bad_frames, self.transport.now());
        if telemetry.time < self.configured {
            // Of the time before the configuration, on its way until now.
            return;
        }
        self.monitor.acknowledged(telemetry.sequence, self.transport.now());
        self.telemetry = Some(*telemetry);
        if let State::Fault(fault) = telemetry.state
            && telemetry.configuration == self.configuration
        {
            // Its own report may be lost.
            self.note_fault(fault);
        }
        self.note_destination_telemetry(telemetry);
        self.note_target_in_force(telemetry);
    }

    /// Notes the fault for which the board stopped by itself. Reports come more than once.
    pub(super) fn note_fault(&mut self, fault: Fault) {
        if self.fault() != Some(fault) {
            let fault = self.explain(fault);
            info!(%fault, "the board has stopped by itself");
            self.fault = Some(fault);
        }
    }

    fn note_answer(&mut self, answer: &Answer) {
        self.clock.update(answer.time, self.transport.now(), false);
        let of_position = answer.refusal.is_some() && self.monitor.refused(answer.id);
        let entry = self.take_answered(answer.id);
        self.refused_positions += u32::from(of_position);
        if let Some(refusal) = answer.refusal {
            if of_position && refusal == Refusal::PositionStale {
                self.evidence.old_position(self.transport.now());
            }
            // A board can refuse every position: one a frame.
            if of_position {
                trace!(id = answer.id, %refusal, "the board refused a position");
            } else {
                debug!(id = answer.id, %refusal, "the board refused a command");
            }
        }
        if (of_position || entry.is_some())
            && matches!(answer.refusal, Some(Refusal::NotGreeted | Refusal::Unconfigured))
        {
            self.monitor.forgotten();
        }
        if let Some(entry) = entry {
            self.note_outcome(&entry, answer);
        }
    }

    /// Removes and returns the command `id` from the table, which was answered; `None` where a
    /// function waits for the answer, or nothing does any more.
    fn take_answered(&mut self, id: u16) -> Option<Entry> {
        let entry = self.commands.get(id)?;
        if matches!(entry.purpose, Purpose::Request { .. }) {
            return None;
        }
        self.commands.take(id)
    }

    /// Takes in the answer to a command of the table.
    fn note_outcome(&mut self, entry: &Entry, answer: &Answer) {
        match entry.purpose {
            Purpose::Request { .. } => {}
            Purpose::Target | Purpose::Path => self.note_destination_answer(answer.refusal),
            Purpose::Operator => self.note_reply(entry, answer),
        }
    }
}
