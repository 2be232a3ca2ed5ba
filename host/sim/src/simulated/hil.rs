//! Hardware in the loop: a simulated rig on a board's motor positions.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use plumb_emulator::plant::{LONGEST_STEP_S, Plant};
use plumb_frame::source::BoxedError;
use plumb_protocol::PerMotor;
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

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        lock(self).plant.tensions_per_weight()
    }
}

impl HilObserver {
    /// Places the rig at the motor positions of a board that stands (full steps from the zero of
    /// travel).
    ///
    /// # Errors
    /// If the rig cannot follow them.
    pub fn board_stands(&mut self, motors: PerMotor<f64>) -> Result<(), SimulationError> {
        let mut rig = lock(&self.rig);
        rig.plant.settle(motors)?;
        rig.moved = self.clock.now();
        Ok(())
    }

    /// Moves the rig to the motor positions of the board (full steps from the zero of travel).
    /// After a longer time than the rig steps at once, the ball is at rest: the program was
    /// suspended, or prepared its first frame on a busy computer.
    ///
    /// # Errors
    /// If the rig cannot follow them.
    pub fn board_moved(&mut self, motors: PerMotor<f64>) -> Result<(), SimulationError> {
        let mut rig = lock(&self.rig);
        let now = self.clock.now();
        let seconds = now - rig.moved;
        if seconds > LONGEST_STEP_S {
            rig.plant.settle(motors)?;
        } else {
            rig.plant.advance(seconds, motors)?;
        }
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

#[cfg(test)]
mod tests {
    use plumb_emulator::plant::{Elastic, ElasticParameters, QuasiStatic, Task};
    use plumb_protocol::MOTORS;

    use super::*;
    use crate::simulated::SimClock;

    /// A program that was suspended for a minute goes on with its rig.
    #[test]
    fn a_rig_follows_its_motors_after_a_long_pause() {
        let Task { geometry, start, .. } = Task::paper();
        let rigid = QuasiStatic::new(geometry, start).unwrap();
        let elastic = Elastic::new(geometry, ElasticParameters::default(), start).unwrap();
        let plants: [Box<dyn Plant + Send>; 2] = [Box::new(rigid), Box::new(elastic)];
        for plant in plants {
            let rig = HilPlant::new(plant);
            let mut observer = rig.observer();
            observer.board_stands([0.0; MOTORS]).unwrap();
            let before = rig.ball();
            lock(&observer.rig).moved -= 60.0;
            observer.board_moved([50.0, 0.0, 0.0]).unwrap();
            assert!((rig.ball() - before).norm() > 0.005);
        }
    }
}
