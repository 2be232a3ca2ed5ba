//! Commands on their way to the board, and requests that wait for an answer.

use plumb_protocol::message::BoardHello;

use super::commands::{Entry, GoalNumber, Purpose};
use super::error::GREETING;
use super::*;

/// Longest wait for a board that has lost the session to report the cause, or its state.
const CAUSE_TIMEOUT: Duration = Duration::from_millis(400);

impl<T: Transport> Link<T> {
    /// Sends a new command without waiting, whose answer counts for nothing. Returns its id.
    pub(super) fn post(&mut self, command: Command) -> Result<u16, LinkError> {
        let id = self.commands.new_id();
        self.send(id, command)?;
        Ok(id)
    }

    /// Sends a new command without waiting, which stands in the table until its answer comes.
    /// Returns its id.
    pub(super) fn post_awaited(
        &mut self,
        command: Command,
        purpose: Purpose,
        goal: Option<GoalNumber>,
    ) -> Result<u16, LinkError> {
        let id = self.commands.add(command, purpose, goal, self.transport.now());
        self.send(id, command)?;
        Ok(id)
    }

    /// Sends the commands again that are due.
    ///
    /// # Errors
    /// Where the answer to one has not come in time, or the link is lost.
    pub(super) fn repeat_commands(&mut self) -> Result<(), LinkError> {
        let now = self.transport.now();
        while let Some(Entry { purpose, .. }) = self.commands.take_expired(now) {
            // A later part replaces a lost one; a fault is the cause, and is reported as such.
            let is_needless = self.is_destination_accepted() || self.fault.is_some();
            if purpose != Purpose::Path || !is_needless {
                return Err(self.silent(purpose.name(), purpose.timeout()));
            }
        }
        while let Some(Entry { id, command, purpose, .. }) = self.commands.take_due(now) {
            debug!(id, "no answer from the board: sending {} again", purpose.name());
            self.send(id, command)?;
        }
        Ok(())
    }

    pub(super) fn send(&mut self, id: u16, command: Command) -> Result<(), LinkError> {
        let frame = frame::encode(&ToBoard { id, command })?;
        self.evidence.sent(self.transport.now());
        self.transport.send(&frame)
    }

    /// Sends a command and waits for its answer, which is no refusal.
    pub(super) fn request(
        &mut self,
        what: &'static str,
        command: Command,
    ) -> Result<Answer, LinkError> {
        let answer = self.exchange(what, command, ANSWER_TIMEOUT, |id, message| match message {
            FromBoard::Answer(answer) if answer.id == id => Some(*answer),
            _ => None,
        })?;
        match answer.refusal {
            None => Ok(answer),
            Some(Refusal::NotGreeted) => Err(self.session_lost()),
            Some(refusal) => Err(LinkError::Refused { what, refusal }),
        }
    }

    /// Requests a command that needs motors at rest, again and again while the board is busy.
    /// Telemetry rounds rates to 0 a little before the motors stand still.
    pub(super) fn request_at_rest(
        &mut self,
        what: &'static str,
        command: Command,
    ) -> Result<Answer, LinkError> {
        let deadline = self.transport.now() + ANSWER_TIMEOUT;
        loop {
            match self.request(what, command) {
                Err(LinkError::Refused { refusal: Refusal::Busy(_), .. })
                    if self.transport.now() < deadline =>
                {
                    self.listen(POLL_INTERVAL)?;
                }
                done => return done,
            }
        }
    }

    /// Sends a Hello and waits for its answer.
    pub(super) fn hello(&mut self, timeout: Duration) -> Result<(), LinkError> {
        let hello =
            self.exchange(GREETING, Command::Hello(Hello::OURS), timeout, |id, message| {
                match message {
                    FromBoard::Hello(hello) if hello.id == id => Some(*hello),
                    _ => None,
                }
            })?;
        if hello.accepted { Ok(()) } else { Err(self.other_version(&hello)) }
    }

    /// Returns the error for a board of another version, with the program that it runs where it
    /// tells that. A board tells it behind its Hello.
    fn other_version(&mut self, board: &BoardHello) -> LinkError {
        // A link that breaks now hides nothing: the Hello has come.
        let _ = self.listen_for(|link| link.provenance.is_some());
        let schema: String = board.hello.schema.iter().map(|b| format!("{b:02x}")).collect();
        let runs = self.provenance.map_or_else(
            || format!("protocol version {} (schema {schema})", board.hello.version),
            |provenance| provenance.to_string(),
        );
        LinkError::Version { port: self.transport.name(), runs }
    }

    /// Listens until `heard`, for 0.4 s at most.
    pub(super) fn listen_for(&mut self, heard: impl Fn(&Self) -> bool) -> Result<(), LinkError> {
        let deadline = self.transport.now() + CAUSE_TIMEOUT;
        while !heard(self) && self.transport.now() < deadline {
            self.listen(POLL_INTERVAL)?;
        }
        Ok(())
    }

    /// Returns the error for a board that was greeted and has lost this session: it restarted, or
    /// a program of another version greeted it.
    pub(super) fn session_lost(&mut self) -> LinkError {
        let (port, cause) = (self.transport.name(), self.ask_start_cause());
        match self.ask_state() {
            None => LinkError::SessionLost { port },
            Some(State::Fault(Fault::Watchdog)) => LinkError::Restarted { port, cause },
            // Nothing of this host's is gone by which a restart could be told.
            Some(_) if !self.clock.was_configured() => LinkError::SessionLost { port },
            // What a restart leads to.
            Some(State::Unconfigured) => LinkError::Restarted { port, cause },
            // So does a stored configuration; the board's clock begins at 0 then.
            Some(_) if !self.clock.has_gone_on() => LinkError::Restarted { port, cause },
            Some(_) => LinkError::OtherProgram { port },
        }
    }

    /// Requests the state of a board that was greeted again; `None` where no answer comes.
    fn ask_state(&mut self) -> Option<State> {
        let state =
            self.exchange(
                "its state",
                Command::Status,
                CAUSE_TIMEOUT,
                |_, message| match message {
                    FromBoard::Telemetry(telemetry) => Some(telemetry.state),
                    _ => None,
                },
            );
        state.ok()
    }

    /// Greets the board again, and returns the cause of its last start; `None` where it reports
    /// none.
    pub fn ask_start_cause(&mut self) -> Option<StartCause> {
        self.start_cause = None;
        self.hello(CAUSE_TIMEOUT).ok()?;
        self.listen_for(|link| link.start_cause.is_some()).ok()?;
        self.start_cause
    }

    /// Waits for telemetry of `time` on the board's clock, or later.
    pub(super) fn telemetry_since(&mut self, time: Micros) -> Result<Telemetry, LinkError> {
        let deadline = self.transport.now() + ANSWER_TIMEOUT;
        loop {
            if let Some(telemetry) = self.telemetry.filter(|telemetry| telemetry.time >= time) {
                return Ok(telemetry);
            }
            if self.transport.now() >= deadline {
                return Err(self.silent("the request for its state", ANSWER_TIMEOUT));
            }
            self.listen(POLL_INTERVAL)?;
        }
    }

    /// Sends a command, and repeats it, until `wanted` accepts a message.
    ///
    /// # Errors
    /// Where no such message comes within `timeout`, or the link is lost.
    pub(super) fn exchange<R>(
        &mut self,
        what: &'static str,
        command: Command,
        timeout: Duration,
        wanted: impl Fn(u16, &FromBoard) -> Option<R>,
    ) -> Result<R, LinkError> {
        let id = self.post_awaited(command, Purpose::Request { name: what, timeout }, None)?;
        let asked = self.transport.now();
        loop {
            let left = self.commands.time_left(self.transport.now());
            let messages = self.listen(left.min(POLL_INTERVAL))?;
            if let Some(found) = messages.iter().find_map(|message| wanted(id, message)) {
                self.commands.take(id);
                let waited = self.transport.now().saturating_sub(asked);
                self.answer_time = Some(self.answer_time.map_or(waited, |it| it.min(waited)));
                return Ok(found);
            }
            self.repeat_commands()?;
        }
    }

    pub(super) fn silent(&self, what: &'static str, waited: Duration) -> LinkError {
        let damage = self.damage();
        LinkError::Silent { port: self.transport.name(), what, waited, damage }
    }
}
