//! The board in virtual time: bytes in and out, a clock that is moved by hand, and a rig that its steps move.

use nalgebra::Point3;
use plumb_core::{Board, BuildLimits, Outbox, TICK_US, Thinker};
use plumb_protocol::message::State;
use plumb_protocol::units::{Micros, Rate, Steps16};

use crate::rig::{Plant, RigError};

/// What an emulated board is built for: the steps of the Pico's firmware, and no storage.
pub const EMULATED: BuildLimits = BuildLimits { max_pulse_rate: 1_250_000, storage: false };

/// Bytes that wait for a host that does not read; the oldest go first, as on a link that nobody listens to.
const WAITING_MAX: usize = 1 << 16;

/// A board whose chip is this program. Nothing happens in it but by [`run_to`](Self::run_to).
pub struct EmulatedBoard {
    board: Board,
    thinker: Thinker,
    plant: Option<Box<dyn Plant + Send>>,
    now: Micros,
    outbox: Outbox,
    waiting: Vec<u8>,
}

impl EmulatedBoard {
    /// A board without a rig: its steps go nowhere.
    pub fn new(build: BuildLimits) -> Self {
        Self {
            board: Board::new(build),
            thinker: Thinker::new(),
            plant: None,
            now: Micros(0),
            outbox: Outbox::new(),
            waiting: Vec::new(),
        }
    }

    /// A board whose motors move `plant`.
    pub fn with_plant(build: BuildLimits, plant: Box<dyn Plant + Send>) -> Self {
        Self { plant: Some(plant), ..Self::new(build) }
    }

    /// The board's clock.
    pub fn now(&self) -> Micros {
        self.now
    }

    /// Bytes arrive at the board now.
    pub fn write(&mut self, bytes: &[u8]) {
        self.board.receive(self.now, bytes, &mut self.outbox);
        self.collect();
    }

    /// What the board has sent since the last call.
    pub fn read(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.waiting)
    }

    /// Lets the board's time pass up to `end`, in whole ticks: the last one ends at `end` or before it.
    ///
    /// # Errors
    /// Where the rig cannot follow its motors; the board is then at the tick in which that happened.
    pub fn run_to(&mut self, end: Micros) -> Result<(), RigError> {
        while self.now.0 + u64::from(TICK_US) <= end.0 {
            // The plan itself is for hardware: the rig follows the positions, which are counted from the same pulses.
            let _ = self.board.tick(self.now, &mut self.thinker, &mut self.outbox);
            self.now.0 += u64::from(TICK_US);
            self.collect();
            let motors = self.motors();
            if let Some(plant) = &mut self.plant {
                plant.advance(f64::from(TICK_US) * 1e-6, motors)?;
            }
        }
        Ok(())
    }

    /// Motor positions, full steps since the start, + pays out.
    pub fn motors(&self) -> [f64; 3] {
        self.board.positions().map(|p| Steps16(p).to_si())
    }

    /// Motor rates, full steps/s.
    pub fn rates(&self) -> [f64; 3] {
        self.board.rates().map(|r| Rate(r).to_si())
    }

    /// The board's state.
    pub fn state(&self) -> State {
        self.board.state()
    }

    /// Where the ball is, metres in the rig frame; `None` without a rig.
    pub fn ball(&self) -> Option<Point3<f64>> {
        self.plant.as_ref().map(|p| p.ball())
    }

    /// Which cables are slack; none without a rig.
    pub fn slack(&self) -> [bool; 3] {
        self.plant.as_ref().map_or([false; 3], |p| p.slack())
    }

    fn collect(&mut self) {
        self.waiting.extend_from_slice(self.outbox.bytes());
        self.outbox.clear();
        let excess = self.waiting.len().saturating_sub(WAITING_MAX);
        self.waiting.drain(..excess);
    }
}
