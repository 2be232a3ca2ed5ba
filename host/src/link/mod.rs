//! The link to the board: greets it, configures it, tells it where the ball is and hears how it goes.

mod error;
mod transport;

use std::time::Duration;

use plumb_protocol::Config;
use plumb_protocol::frame::{self, Accumulator};
use plumb_protocol::message::{
    BoardHello, Command, Fault, FromBoard, Hello, Position, Refusal, Telemetry, ToBoard,
};
use plumb_protocol::units::{Covariance, Point};

pub use error::LinkError;
pub use transport::{Memory, Serial, Transport, boards};

/// A board that is there answers within this, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(3);

/// How long each look at the port waits.
const GLANCE: Duration = Duration::from_millis(20);

/// A greeted board.
pub struct Link<T> {
    transport: T,
    accumulator: Accumulator,
    next_id: u16,
    sequence: u16,
    telemetry: Option<Telemetry>,
    fault: Option<Fault>,
    refused_positions: u32,
    bad_frames: u32,
}

impl<T: Transport> Link<T> {
    /// Greets the board at the other end.
    ///
    /// # Errors
    /// Where nothing answers, or a board of another version does.
    pub fn greet(transport: T) -> Result<Self, LinkError> {
        let mut link = Self::open(transport)?;
        let id = link.post(Command::Hello(Hello::OURS))?;
        let hello = link.wait_for("a greeting", |message| match message {
            FromBoard::Hello(hello) if hello.id == id => Some(*hello),
            _ => None,
        })?;
        if hello.accepted { Ok(link) } else { Err(other_version(&hello)) }
    }

    /// Sends the board into its chip's bootloader, where it waits for new firmware; one of any version, which needs no
    /// greeting. Its motors ramp down first.
    ///
    /// # Errors
    /// Where nothing answers, or the link fails.
    pub fn bootloader(transport: T) -> Result<(), LinkError> {
        Self::open(transport)?.request("to go into its bootloader", Command::Bootloader)
    }

    fn open(transport: T) -> Result<Self, LinkError> {
        let mut link = Self {
            transport,
            accumulator: Accumulator::new(),
            next_id: 1,
            sequence: 0,
            telemetry: None,
            fault: None,
            refused_positions: 0,
            bad_frames: 0,
        };
        // A zero first ends whatever the board has half received.
        link.transport.send(&[0])?;
        Ok(link)
    }

    /// Configures the board; a fault that it was left in is cleared first.
    ///
    /// # Errors
    /// Where it refuses, or the link fails.
    pub fn configure(&mut self, config: Config) -> Result<(), LinkError> {
        self.stop()?;
        self.request("to clear its fault", Command::ClearFault)?;
        self.fault = None;
        self.request("the configuration", Command::Configure(config))
    }

    /// Has the board keep its configuration over a loss of power.
    ///
    /// # Errors
    /// Where it has no place to keep it, could not write it, or the link fails.
    pub fn store(&mut self) -> Result<(), LinkError> {
        self.request("to store its configuration", Command::Store)
    }

    /// How things are now.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn status(&mut self) -> Result<Telemetry, LinkError> {
        self.post(Command::Status)?;
        self.wait_for("for its state", |message| match message {
            FromBoard::Telemetry(telemetry) => Some(*telemetry),
            _ => None,
        })
    }

    /// Sets the target, in the rig frame.
    ///
    /// # Errors
    /// Where the board refuses it, or the link fails.
    pub fn target(&mut self, target: Point) -> Result<(), LinkError> {
        // What was told before is of another target.
        self.telemetry = None;
        self.request("the target", Command::Target(target))
    }

    /// Ramps down and waits until the motors stand still.
    ///
    /// # Errors
    /// Where the link fails, or the motors do not come to rest within a few seconds.
    pub fn stop(&mut self) -> Result<(), LinkError> {
        self.request("to stop", Command::Stop)?;
        for _ in 0..PATIENCE.as_millis() / GLANCE.as_millis() {
            if self.status()?.rates.iter().all(|rate| rate.0 == 0) {
                return Ok(());
            }
            self.listen(GLANCE)?;
        }
        Err(self.silent("to come to rest"))
    }

    /// Reports where the ball was (`None`: not seen) in a picture taken `age` ago, and how sure that is. Does not wait for
    /// an answer.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn position(
        &mut self,
        ball: Option<Point>,
        covariance: Option<Covariance>,
        age: Duration,
    ) -> Result<(), LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        let age_us = u32::try_from(age.as_micros()).unwrap_or(u32::MAX);
        self.post(Command::Position(Position { sequence: self.sequence, age_us, ball, covariance })).map(drop)
    }

    /// Takes in what has arrived, without waiting.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn poll(&mut self) -> Result<(), LinkError> {
        self.listen(Duration::ZERO).map(drop)
    }

    /// The newest telemetry.
    pub fn telemetry(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref()
    }

    /// Why the board has stopped by itself, if it has.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Positions that the board did not take, since the greeting.
    pub fn refused_positions(&self) -> u32 {
        self.refused_positions
    }

    /// Frames from the board that were torn or corrupted, since the greeting.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }

    /// Sends a command without waiting; its id.
    fn post(&mut self, command: Command) -> Result<u16, LinkError> {
        let id = self.next_id;
        // 0 is what the board says of a command that it could not read.
        self.next_id = self.next_id.checked_add(1).unwrap_or(1);
        self.transport.send(&frame::encode(&ToBoard { id, command })?)?;
        Ok(id)
    }

    /// Sends a command and waits for its answer.
    fn request(&mut self, what: &'static str, command: Command) -> Result<(), LinkError> {
        let id = self.post(command)?;
        let answer = self.wait_for(what, |message| match message {
            FromBoard::Answer(answer) if answer.id == id => Some(*answer),
            _ => None,
        })?;
        match answer.refusal {
            None => Ok(()),
            Some(refusal) => Err(LinkError::Refused { what, refusal }),
        }
    }

    /// Listens until a message is what is waited for.
    fn wait_for<R>(
        &mut self,
        what: &'static str,
        wanted: impl Fn(&FromBoard) -> Option<R>,
    ) -> Result<R, LinkError> {
        for _ in 0..PATIENCE.as_millis() / GLANCE.as_millis() {
            let messages = self.listen(GLANCE)?;
            if let Some(found) = messages.iter().find_map(&wanted) {
                return Ok(found);
            }
        }
        Err(self.silent(what))
    }

    fn silent(&self, what: &'static str) -> LinkError {
        LinkError::Silent { port: self.transport.name(), what, waited: PATIENCE }
    }

    /// Takes in what has arrived, or arrives within `wait`.
    fn listen(&mut self, wait: Duration) -> Result<Vec<FromBoard>, LinkError> {
        let mut bytes = Vec::new();
        self.transport.receive(&mut bytes, wait)?;
        let mut messages = Vec::new();
        for byte in bytes {
            match self.accumulator.push::<FromBoard>(byte) {
                None => {}
                Some(Ok(message)) => {
                    self.note(&message);
                    messages.push(message);
                }
                Some(Err(_)) => self.bad_frames += 1,
            }
        }
        Ok(messages)
    }

    /// Keeps what a message says of the board.
    fn note(&mut self, message: &FromBoard) {
        match message {
            FromBoard::Telemetry(telemetry) => self.telemetry = Some(*telemetry),
            FromBoard::Fault(report) => self.fault = Some(report.fault),
            FromBoard::Answer(answer) => {
                let of_position = matches!(
                    answer.refusal,
                    Some(Refusal::PositionStale | Refusal::PositionOutOfOrder | Refusal::BallOutside)
                );
                self.refused_positions += u32::from(of_position);
            }
            FromBoard::Hello(_) | FromBoard::Started(_) => {}
        }
    }
}

fn other_version(board: &BoardHello) -> LinkError {
    let schema = board.hello.schema.iter().map(|b| format!("{b:02x}")).collect();
    LinkError::Version { board: board.hello.version, schema }
}
