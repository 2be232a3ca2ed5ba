//! Hardware in the loop: a simulated rig on a board's motor positions.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use plumb_emulator::plant::Plant;
use plumb_frame::source::BoxedError;
use plumb_runtime::observer::{FrameRecord, Observer};

use super::SimulationError;
use super::clock::{RealTime, RealTimeBall, RealTimeRig};

/// Hardware in the loop: a simulated rig that follows the motor positions of any board, real or
/// emulated, in real time. The rig's start is where the board's motors are at 0: a second run goes
/// on where the first one left the ball.
pub type HilPlant = RealTimeRig<Arc<Mutex<HilRig>>>;

/// Observer that moves the rig of a [`HilPlant`] to the motor positions of the telemetry. A rig
/// that cannot follow ends the run.
pub struct HilObserver {
    rig: Arc<Mutex<HilRig>>,
    clock: RealTime,
    failure: Option<SimulationError>,
}

/// Simulated rig that a [`HilObserver`] moves.
pub struct HilRig {
    plant: Box<dyn Plant + Send>,
    /// Time of the last motion, seconds.
    moved: f64,
}

impl HilPlant {
    /// Creates the rig of `plant`, whose motors are at 0.
    pub fn new(plant: Box<dyn Plant + Send>) -> Self {
        let rig = HilRig { plant, moved: 0.0 };
        Self::start(Arc::new(Mutex::new(rig)))
    }

    /// Returns the observer that moves the rig.
    pub fn observer(&self) -> HilObserver {
        HilObserver { rig: Arc::clone(&self.ball), clock: self.clock, failure: None }
    }
}

impl RealTimeBall for Arc<Mutex<HilRig>> {
    fn ball(&self) -> Point3<f64> {
        lock(self).plant.ball()
    }

    fn tensions_per_weight(&self) -> Option<[f64; 3]> {
        lock(self).plant.tensions_per_weight()
    }
}

impl HilObserver {
    /// Places the rig at the motor positions of a board that stands (full steps from the zero of
    /// travel).
    ///
    /// # Errors
    /// If the rig cannot follow them.
    pub fn board_stands(&mut self, motors: [f64; 3]) -> Result<(), SimulationError> {
        let mut rig = lock(&self.rig);
        rig.plant.settle(motors)?;
        rig.moved = self.clock.now();
        Ok(())
    }

    /// Moves the rig to the motor positions of the board (full steps from the zero of travel).
    ///
    /// # Errors
    /// If the rig cannot follow them.
    pub fn board_moved(&mut self, motors: [f64; 3]) -> Result<(), SimulationError> {
        let mut rig = lock(&self.rig);
        let now = self.clock.now();
        let seconds = now - rig.moved;
        rig.plant.advance(seconds, motors)?;
        rig.moved = now;
        Ok(())
    }
}

impl Observer for HilObserver {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(board) = &record.board {
            self.failure = self.board_moved(board.motors).err();
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.failure.take().map(Into::into)
    }
}

fn lock(rig: &Mutex<HilRig>) -> MutexGuard<'_, HilRig> {
    rig.lock().unwrap_or_else(PoisonError::into_inner)
}
