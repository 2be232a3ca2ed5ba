//! The board's core with what its chip adds: a worker for the laws and a queue of bytes to the
//! host. Everything outside the chip that runs the core goes through here.

use plumb_core::config_store::Stored;
use plumb_core::law_worker::{LawRequest, LawResponse};
use plumb_core::{Board, BuildLimits, LawWorker, Outbox, Tick};
use plumb_protocol::diagnostics::{ChipCounts, ChipMeasurement};
use plumb_protocol::frame::{self, Accumulator, FrameError};
use plumb_protocol::message::{
    Command, DriverFault, DriverReading, FromBoard, Hello, Request, StartCause, ToBoard,
};
use plumb_protocol::units::{Micros, Rate, Steps16};
use plumb_protocol::{Config, MOTORS, PerMotor, Wiring};

/// Time from a request to the law worker to its response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LawDelay {
    /// The response comes in the tick of its request: the law takes no time.
    #[default]
    SameTick,
    /// The response comes before the plan of the tick that is this number of ticks later, 1 or
    /// more.
    Ticks(u32),
    /// No response comes.
    Never,
}

/// A board of [`plumb_core`] with a law worker and a queue to the host. Time is an argument: the
/// caller has the clock, and calls [`tick`](Self::tick) every [`TICK_US`](plumb_core::TICK_US).
///
/// ```
/// use plumb_emulator::{EMULATED, Harness, LawDelay};
/// use plumb_protocol::message::{Command, FromBoard, Hello};
/// use plumb_protocol::units::Micros;
///
/// let mut harness = Harness::new(EMULATED, LawDelay::Ticks(4));
/// harness.send(Micros(0), Command::Hello(Hello::OURS));
/// harness.tick(Micros(0));
/// assert!(matches!(harness.take_messages()[0], Ok(FromBoard::Hello(_))));
/// ```
pub struct Harness {
    build: BuildLimits,
    /// The board.
    pub board: Board,
    /// The law worker. Only [`tick`](Self::tick) uses it.
    pub law_worker: LawWorker,
    /// Time that the law worker takes.
    pub law_delay: LawDelay,
    /// Whether [`tick`](Self::tick) and [`plan`](Self::plan) set up drivers on a UART, which then
    /// takes no time. Otherwise the caller reports it with
    /// [`on_drivers_ready`](Self::on_drivers_ready).
    pub sets_up_drivers: bool,
    /// Messages of the board that were not taken.
    pub outbox: Outbox,
    /// Request in progress, with the ticks until its response.
    in_progress: Option<(LawRequest, u32)>,
    /// Request that the last tick made.
    request: Option<LawRequest>,
    /// Response that the last tick was given.
    response: Option<LawResponse>,
    /// Decoder of the host's bytes.
    decoder: Accumulator,
    /// Decoder of the board's bytes.
    accumulator: Accumulator,
    /// Id of the last request of [`send`](Self::send).
    id: u16,
}

impl Harness {
    /// Creates a board that has just got power.
    pub fn new(build: BuildLimits, law_delay: LawDelay) -> Self {
        Self {
            build,
            board: Board::new(build),
            law_worker: LawWorker::new(),
            law_delay,
            sets_up_drivers: true,
            outbox: Outbox::new(),
            in_progress: None,
            request: None,
            response: None,
            decoder: Accumulator::new(),
            accumulator: Accumulator::new(),
            id: 0,
        }
    }

    /// Creates a board that has been greeted and has this wiring and configuration, unless it
    /// refuses them. Its answers are not taken.
    pub fn configured(
        build: BuildLimits,
        law_delay: LawDelay,
        wiring: Wiring,
        config: Config,
    ) -> Self {
        let mut harness = Self::new(build, law_delay);
        harness.send(Micros(0), Command::Hello(Hello::OURS));
        harness.send(Micros(0), Command::Wire(wiring));
        harness.send(Micros(0), Command::Configure(config));
        harness
    }

    /// Restarts the board with `cause` and what it has stored, if there is anything. Messages that
    /// were not taken are lost, and so is a law's response.
    pub fn restart(&mut self, cause: StartCause, stored: Option<&Stored>) {
        let (id, sets_up_drivers) = (self.id, self.sets_up_drivers);
        *self = Self { id, sets_up_drivers, ..Self::new(self.build, self.law_delay) };
        self.board.set_start_cause(cause);
        if let Some(stored) = stored {
            self.board.restore(&stored.wiring, &stored.config);
        }
    }

    /// Passes bytes of the host, in any pieces, as frames to the board.
    pub fn receive(&mut self, now: Micros, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let decoded = self.decoder.take(&mut bytes);
            if let Some(request) = decoded.map(|message| message.and_then(Request::read)) {
                let request = request.as_ref().map_err(|error| *error);
                self.board.on_frame(now, request, &mut self.outbox);
            }
        }
    }

    /// Passes a command as a frame to the board. Returns its id, which counts from 1.
    pub fn send(&mut self, now: Micros, command: Command) -> u16 {
        self.id = self.id.checked_add(1).unwrap_or(1);
        self.send_as(now, self.id, command);
        self.id
    }

    /// Passes a command with this id as a frame to the board.
    pub fn send_as(&mut self, now: Micros, id: u16, command: Command) {
        // Every command fits a frame.
        if let Ok(frame) = frame::encode(&ToBoard { id, command }) {
            self.receive(now, &frame);
        }
    }

    /// Runs the tick that begins at `now`, with the law worker. Returns what the chip carries out
    /// besides the pulses, where that may have changed.
    pub fn tick(&mut self, now: Micros) -> Option<Tick> {
        let delay = match self.law_delay {
            LawDelay::SameTick => {
                let tick = self.board.tick(now, &mut self.law_worker, &mut self.outbox);
                self.set_up_drivers(tick);
                return tick;
            }
            LawDelay::Ticks(ticks) => Some(ticks),
            LawDelay::Never => None,
        };
        self.response = self.due_response();
        let tick = self.plan(now, self.response);
        self.request = self.report(now);
        if let Some(request) = self.request {
            self.in_progress = delay.map(|ticks| (request, ticks));
        }
        tick
    }

    /// Returns the law worker's response if it is due in this tick.
    fn due_response(&mut self) -> Option<LawResponse> {
        let (_, left) = self.in_progress.as_mut()?;
        *left = left.saturating_sub(1);
        let (request, _) = self.in_progress.take_if(|(_, left)| *left == 0)?;
        Some(self.law_worker.respond(&request))
    }

    /// Runs the first half of a tick, with a response of a law worker of the caller. See
    /// [`Board::plan`].
    pub fn plan(&mut self, now: Micros, response: Option<LawResponse>) -> Option<Tick> {
        if let Some(response) = response {
            self.board.on_law_response(&response);
        }
        let tick = self.board.plan(now, &mut self.outbox);
        self.set_up_drivers(tick);
        tick
    }

    /// Sets up drivers on a UART where the board asks for it, unless the caller does.
    fn set_up_drivers(&mut self, asked: Option<Tick>) {
        if self.sets_up_drivers && asked.is_some_and(|tick| tick.set_up_drivers) {
            self.on_drivers_ready();
        }
    }

    /// Runs the second half of a tick. Returns a request for the caller's law worker. See
    /// [`Board::report`].
    pub fn report(&mut self, now: Micros) -> Option<LawRequest> {
        self.board.report(now, &mut self.outbox);
        self.board.take_law_request()
    }

    /// Returns the motor positions, full steps since the board's start, + pays out. Home does not
    /// change them.
    pub fn motors(&self) -> PerMotor<f64> {
        self.board.positions().map(|p| Steps16(p).to_si())
    }

    /// Returns the motor rates, full steps/s, + pays out.
    pub fn rates(&self) -> PerMotor<f64> {
        self.board.rates().map(|r| Rate(r).to_si())
    }

    /// Returns the request that the last tick made; `None` with [`LawDelay::SameTick`].
    pub fn law_request(&self) -> Option<&LawRequest> {
        self.request.as_ref()
    }

    /// Returns the response that the last tick was given; `None` with [`LawDelay::SameTick`].
    pub fn law_response(&self) -> Option<&LawResponse> {
        self.response.as_ref()
    }

    /// Stops the board for its emergency input. See [`Board::on_emergency_stop`].
    pub fn on_emergency_stop(&mut self, now: Micros, missing: PerMotor<i32>) {
        self.board.on_emergency_stop(now, missing, &mut self.outbox);
    }

    /// Stops the board because a motor driver failed.
    pub fn on_driver_failure(&mut self, now: Micros, fault: DriverFault) {
        self.board.on_driver_failure(now, fault, &mut self.outbox);
    }

    /// Reports that the drivers on a UART are set up.
    pub fn on_drivers_ready(&mut self) {
        self.board.on_drivers_ready();
    }

    /// Reports readings of drivers on a UART.
    pub fn on_driver_readings(&mut self, now: Micros, readings: [DriverReading; MOTORS]) {
        self.board.on_driver_readings(now, readings, &mut self.outbox);
    }

    /// Reports the end of a Store: whether the configuration was written.
    pub fn on_stored(&mut self, now: Micros, written: bool) {
        self.board.on_stored(now, written, &mut self.outbox);
    }

    /// Gives the board the chip's counts, for its diagnostics.
    pub fn on_diagnosed(&mut self, counts: ChipCounts) {
        self.board.on_diagnosed(counts, &mut self.outbox);
    }

    /// Gives the board what the chip has measured; `None` if it measures nothing.
    pub fn on_measured(&mut self, now: Micros, chip: Option<ChipMeasurement>) {
        self.board.on_measured(now, chip, &mut self.outbox);
    }

    /// Takes what the board sends: bytes.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        let bytes = self.outbox.bytes().to_vec();
        self.outbox.clear();
        bytes
    }

    /// Takes what the board sends: messages, and errors of frames that are not whole.
    pub fn take_messages(&mut self) -> Vec<Result<FromBoard, FrameError>> {
        let accumulator = &mut self.accumulator;
        let bytes = self.outbox.bytes().iter();
        let messages = bytes.filter_map(|&byte| accumulator.push(byte)).collect();
        self.outbox.clear();
        messages
    }
}
