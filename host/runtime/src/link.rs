//! Link to the board: connects, configures the board, sends positions, and receives telemetry.
//!
//! Frames may be lost or late. A command is repeated with its id until its answer comes
//! (`commands.rs`), a target also until telemetry names it. Telemetry counts only where it names
//! this link's configuration; about a target it counts only where it names that target.
//! [`Link::poll`] fails once the board is silent, lags or has restarted.

mod commands;
mod destination;
mod error;
mod evidence;
mod exchange;
mod goal;
mod incoming;
mod monitor;
mod motion;
mod pseudo_terminal;
mod service;
mod submission;
mod timing;
mod transport;

use std::time::Duration;

use plumb_protocol::diagnostics::Diagnostics;
use plumb_protocol::frame::{self, Accumulator};
use plumb_protocol::message::{
    Answer, Command, DriverReading, Fault, FromBoard, Hello, Position, Refusal, StartCause, State,
    Telemetry, ToBoard,
};
use plumb_protocol::prior::Prior;
use plumb_protocol::provenance::BoardKind;
use plumb_protocol::units::{Covariance, Micrometres, Micros, Point};
use plumb_protocol::{Config, MOTORS, MotorList, Provenance, Wiring};
use tracing::{debug, info};

use crate::board_fault::BoardFault;
use crate::wakeups::LateWakeups;
use commands::{CommandTable, GoalNumber, Purpose};
use destination::Destination;
use evidence::Evidence;
use monitor::{BoardClock, LinkMonitor, Problem};
use motion::{JogUnderWay, RampDown};
use timing::{ANSWER_TIMEOUT, KEEP_ALIVE, POLL_INTERVAL};

pub use error::{Damage, LinkError, other_port, windows_port};
pub use evidence::LATE;
pub use pseudo_terminal::is_pseudo_terminal;
pub use transport::{Serial, Transport, boards};

/// Answer of the board to a submitted command: `Err` with the reason of its refusal.
pub type Reply = Result<(), Refusal>;

/// Connection to a board that has answered the greeting.
pub struct Link<T> {
    transport: T,
    accumulator: Accumulator,
    /// Commands that wait for their answers.
    commands: CommandTable,
    sequence: u16,
    /// Id of the Configure command in force.
    configuration: Option<u16>,
    /// The configuration in force, where this link has sent it.
    config: Option<Config>,
    /// When the board carried it out, or cleared its last fault, on the board's clock. Earlier
    /// telemetry is ignored.
    configured: Micros,
    /// Target or path that the board was asked for last.
    destination: Option<Destination>,
    /// Number of the last goal.
    goal: GoalNumber,
    /// Number of the last part of a path.
    references: u16,
    /// The last jog.
    jog: Option<JogUnderWay>,
    /// Answer to the last submitted command.
    reply: Option<Reply>,
    telemetry: Option<Telemetry>,
    /// Newest readings of drivers on a UART, since the configuration.
    drivers: Option<MotorList<DriverReading>>,
    fault: Option<BoardFault>,
    start_cause: Option<StartCause>,
    /// The board's program and chip; `None` before the board has told them.
    provenance: Option<Provenance>,
    /// Shortest time from a request to its answer.
    answer_time: Option<Duration>,
    monitor: LinkMonitor,
    /// Counts that tell the cause of a fault.
    evidence: Evidence,
    clock: BoardClock,
    refused_positions: u32,
    bad_frames: u32,
}

impl<T: Transport> Link<T> {
    /// Connects to the board at the other end: sends the greeting and waits for its answer.
    ///
    /// # Errors
    /// Where no board answers, or one of another version.
    pub fn connect(transport: T) -> Result<Self, LinkError> {
        let mut link = Self::open(transport)?;
        link.hello(ANSWER_TIMEOUT)?;
        link.check_leading()?;
        link.monitor.begin(link.transport.now());
        info!(port = link.transport.name(), "connected to the board");
        Ok(link)
    }

    /// Checks that a board whose time is that of the link is emulated: the time of a real one is
    /// that of the world.
    fn check_leading(&mut self) -> Result<(), LinkError> {
        if !self.transport.leads() {
            return Ok(());
        }
        self.listen_for(|link| link.provenance.is_some())?;
        match self.provenance {
            Some(Provenance { board: BoardKind::Emulated, .. }) => Ok(()),
            _ => Err(LinkError::Leads { port: self.transport.name() }),
        }
    }

    fn open(transport: T) -> Result<Self, LinkError> {
        let mut link = Self {
            transport,
            accumulator: Accumulator::new(),
            commands: CommandTable::default(),
            sequence: 0,
            configuration: None,
            config: None,
            configured: Micros(0),
            destination: None,
            goal: GoalNumber::default(),
            references: 0,
            jog: None,
            reply: None,
            telemetry: None,
            drivers: None,
            fault: None,
            start_cause: None,
            provenance: None,
            answer_time: None,
            monitor: LinkMonitor::default(),
            evidence: Evidence::default(),
            clock: BoardClock::default(),
            refused_positions: 0,
            bad_frames: 0,
        };
        // A zero first ends whatever the board has half received.
        link.transport.send(&[0])?;
        Ok(link)
    }

    /// Wires and configures the board; its motors ramp down first.
    ///
    /// # Errors
    /// [`LinkError::Faulted`] where the board has stopped by itself before: the fault stays until
    /// [`clear_fault`](Self::clear_fault). Others where it refuses, or the link fails.
    pub fn configure(&mut self, wiring: Wiring, config: Config) -> Result<(), LinkError> {
        self.stop()?;
        // Both are the configuration for a person.
        let what = "the configuration";
        self.request(what, Command::Wire(wiring))?;
        let answer = self.request_at_rest(what, Command::Configure(config));
        let Answer { id, time, .. } = answer.map_err(|error| match error {
            LinkError::Refused { refusal: Refusal::Faulted(fault), .. } => {
                LinkError::Faulted { port: self.transport.name(), fault }
            }
            error => error,
        })?;
        (self.configuration, self.configured) = (Some(id), time);
        self.config = Some(config);
        (self.telemetry, self.drivers, self.fault) = (None, None, None);
        let deadline = Duration::from_millis(config.deadlines.host.0.into());
        self.monitor.begin_configured(self.transport.now(), deadline);
        info!(id, "configured the board");
        Ok(())
    }

    /// Tells a board at rest what is known of the rig; its law begins with it.
    ///
    /// # Errors
    /// Where the board refuses, or the link fails.
    pub fn know(&mut self, prior: Prior) -> Result<(), LinkError> {
        self.request("what is known of the rig", Command::Prior(prior)).map(|_| ())
    }

    /// Returns the present telemetry.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn status(&mut self) -> Result<Telemetry, LinkError> {
        let asked = self.request("the request for its state", Command::Status)?;
        self.telemetry_since(asked.time)
    }

    /// Ramps down and waits until the motors stand still.
    ///
    /// # Errors
    /// Where the link fails, or the motors do not come to rest in the time that their ramp takes.
    pub fn stop(&mut self) -> Result<(), LinkError> {
        self.leave_destination();
        self.commands.give_up(Purpose::Operator);
        debug!("stopping the motors");
        self.request("the request to stop", Command::Stop)?;
        let mut ramp = RampDown::begin(self.transport.now());
        loop {
            let Telemetry { state, rates, .. } = self.status()?;
            // The last rates of a ramp are rounded to 0 while the board still stops.
            if rates.iter().all(|rate| rate.0 == 0) && state != State::Stopping {
                debug!(%state, "the motors stand");
                return Ok(());
            }
            self.check_ramp(&mut ramp, &rates)?;
            self.listen(POLL_INTERVAL)?;
        }
    }

    /// Sends Stop three times, without waiting for an answer, to a board that may be gone. A board
    /// without a host stops by itself.
    pub fn abandon(&mut self) {
        for _ in 0..3 {
            let sent = self.post(Command::Stop).and_then(|_| self.listen(POLL_INTERVAL));
            if sent.is_err() {
                return;
            }
        }
    }

    /// Reports where the ball was (`None`: not seen) in a frame taken `age` ago, and how sure
    /// that is. Does not wait for an answer.
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
        let (sequence, age_us) =
            (self.sequence, u32::try_from(age.as_micros()).unwrap_or(u32::MAX));
        let ball = ball.map(|ball| self.in_reach(ball));
        let id = self.post(Command::Position(Position { sequence, age_us, ball, covariance }))?;
        self.monitor.sent(sequence, id, self.transport.now());
        self.evidence.position(age, ball, self.transport.now());
        Ok(())
    }

    /// Returns the ball's position as its motors can change it: two move it in the plane x = 0.
    fn in_reach(&self, ball: Point) -> Point {
        let is_planar = self.config.is_some_and(|config| config.motors.len() < MOTORS);
        let [x, y, z] = ball.0;
        Point([if is_planar { Micrometres(0) } else { x }, y, z])
    }

    /// Returns the number of the position that was sent last.
    pub fn sequence(&self) -> u16 {
        self.sequence
    }

    /// Handles the messages that have arrived, without waiting, and repeats the commands that the
    /// board has not answered.
    ///
    /// # Errors
    /// Where the link is lost, the board has fallen silent, lags behind, has restarted, was greeted
    /// by a program of another version or has another configuration, refuses the target or the
    /// path, or does not answer a command.
    pub fn poll(&mut self) -> Result<(), LinkError> {
        self.listen(Duration::ZERO)?;
        self.repeat_commands()?;
        self.check_monitor()?;
        self.check_destination()
    }

    /// Asks for the board's state if nothing was sent for 50 ms: a camera that delivers
    /// nothing must not look like a silent host. Does not wait for an answer.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn keep_alive(&mut self) -> Result<(), LinkError> {
        if self.evidence.silence(self.transport.now()) >= KEEP_ALIVE {
            self.post(Command::Status)?;
        }
        Ok(())
    }

    /// Returns the name of the port.
    pub fn port(&self) -> String {
        self.transport.name()
    }

    /// Returns the shortest time from a request to its answer so far.
    pub fn answer_time(&self) -> Option<Duration> {
        self.answer_time
    }

    /// Returns the newest telemetry under this link's configuration.
    pub fn telemetry(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|telemetry| telemetry.configuration == self.configuration)
    }

    /// Returns the fault for which the board stopped by itself, if there is one.
    pub fn fault(&self) -> Option<Fault> {
        self.fault.map(|it| it.fault)
    }

    /// Returns the same with its cause, where this link has counted one.
    pub fn board_fault(&self) -> Option<BoardFault> {
        self.fault
    }

    /// Returns a fault of the board with its cause, where the counts show one.
    fn explain(&self, fault: Fault) -> BoardFault {
        let explain = |config: &Config| self.evidence.explain(fault, config, self.transport.now());
        self.config.as_ref().map_or_else(|| fault.into(), explain)
    }

    /// Begins to count late wake-ups: times without a message to the board above [`LATE`].
    pub fn count_late_wakeups(&mut self) {
        self.evidence.count_late_wakeups(self.transport.now());
    }

    /// Returns the late wake-ups since the count began; `None` where there was none.
    pub fn late_wakeups(&self) -> Option<LateWakeups> {
        self.evidence.late_wakeups()
    }

    /// Returns the frames that were damaged on the wire lately.
    fn damage(&self) -> Damage {
        self.evidence.damage(self.transport.now())
    }

    /// Returns the number of positions that the board refused since the greeting.
    pub fn refused_positions(&self) -> u32 {
        self.refused_positions
    }

    /// Returns the number of torn or corrupted frames from the board since the greeting.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }

    fn check_monitor(&mut self) -> Result<(), LinkError> {
        if self.configuration.is_none() {
            return Ok(());
        }
        let (port, damage) = (self.transport.name(), self.damage());
        match self.monitor.problem(self.transport.now()) {
            Some(Problem::Silent(age)) => Err(LinkError::NoTelemetry { port, age, damage }),
            Some(Problem::Lagging(age)) => Err(LinkError::Lagging { port, age, damage }),
            Some(Problem::Restarted) => Err(self.session_lost()),
            None => match self.telemetry {
                Some(Telemetry { state: State::Unconfigured, .. }) => Err(self.session_lost()),
                Some(telemetry) if telemetry.configuration != self.configuration => {
                    Err(LinkError::Reconfigured { port })
                }
                _ => Ok(()),
            },
        }
    }
}

/// What the link knows of the board at one time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LinkView {
    /// Newest telemetry under this link's configuration.
    pub(crate) telemetry: Option<Telemetry>,
    /// Newest readings of drivers on a UART.
    pub(crate) drivers: Option<MotorList<DriverReading>>,
    /// What the telemetry is about.
    pub(crate) subject: Subject,
    /// Fault for which the board stopped by itself.
    pub(crate) fault: Option<BoardFault>,
    /// Whether a target or a submitted command has no answer.
    pub(crate) is_answer_due: bool,
    /// Number of the position that was sent last.
    pub(crate) sequence: u16,
}

/// What telemetry is about.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Subject {
    /// The target or the path that the board was asked for last.
    pub(crate) is_destination: bool,
    /// A path.
    pub(crate) is_path: bool,
    /// A part of the path that comes to rest where the newest one does.
    pub(crate) is_rest: bool,
}

impl LinkView {
    /// Returns the telemetry if it is about the target or the path asked for last.
    pub(crate) fn about_target(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_destination)
    }

    /// Returns the telemetry if it is about the path that was sent last.
    pub(crate) fn about_path(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_path)
    }

    /// Returns the telemetry if it is about a part of the path that comes to rest where the newest
    /// one does.
    pub(crate) fn about_rest(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_rest)
    }

    /// Notes that the path was given up.
    pub(crate) fn leave_path(&mut self) {
        if self.subject.is_path {
            self.subject = Subject::default();
        }
    }
}

impl<T: Transport> Link<T> {
    /// Returns what the link knows of the board now.
    pub(crate) fn view(&self) -> LinkView {
        LinkView {
            telemetry: self.telemetry().copied(),
            drivers: self.drivers,
            subject: Subject {
                is_destination: self.target_telemetry().is_some(),
                is_path: self.path_telemetry().is_some(),
                is_rest: self.rest_telemetry().is_some(),
            },
            fault: self.fault,
            is_answer_due: self.is_answer_due(),
            sequence: self.sequence,
        }
    }
}

#[cfg(test)]
mod tests;
