//! Hardware in the loop: a simulated rig on a board's motor positions.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use plumb_emulator::plant::{LONGEST_STEP_S, Plant, RigError};
use plumb_protocol::PerMotor;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::observer::{FrameRecord, Observer};

use super::SimulationError;
use super::clock::{RealTime, RealTimeBall, RealTimeRig};

/// Longest time for which the motors are assumed to go on as reported, seconds. On a busy computer
/// a report may be older.
const MAX_AHEAD_S: f64 = 0.1;
/// Rate at which the clock of the board may be slower than that of the computer: five times what
/// quartzes differ by.
const DRIFT: f64 = 5e-4;

/// Hardware in the loop: a simulated rig that follows the motor positions of any board, real or
/// emulated, in real time. The rig's start is where the board's motors are at 0: a second run goes
/// on where the first one left the ball.
pub type HilPlant = RealTimeRig<Arc<Mutex<HilRig>>>;

/// Observer that tells the rig of a [`HilPlant`] what the telemetry says of the motors.
pub struct HilObserver {
    rig: Arc<Mutex<HilRig>>,
    clock: RealTime,
    /// Difference of the computer's clock and the board's, seconds: the least that was seen, since
    /// reports that took longer have a larger one.
    ahead: f64,
    /// When that was updated, seconds.
    updated: f64,
}

/// Simulated rig that a [`HilObserver`] informs.
pub struct HilRig {
    plant: Box<dyn Plant + Send>,
    /// Time of the last motion, seconds.
    moved: f64,
    /// The motors at a moment of the computer's clock.
    reported: BoardMotion,
}

/// Motion of a board's motors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BoardMotion {
    /// Time, seconds.
    pub time: f64,
    /// Motor positions from the zero of travel, full steps.
    pub motors: PerMotor<f64>,
    /// Motor rates, full steps/s.
    pub rates: PerMotor<f64>,
}

impl BoardMotion {
    /// Returns where the motors are at `time`, seconds, if they go on.
    fn motors_at(&self, time: f64) -> PerMotor<f64> {
        let ahead = (time - self.time).clamp(0.0, MAX_AHEAD_S);
        std::array::from_fn(|k| self.motors[k] + ahead * self.rates[k])
    }
}

impl HilRig {
    /// Moves the rig to `now`, seconds. After a longer time than the rig steps at once, the ball is
    /// at rest: the program was suspended, or prepared its first frame on a busy computer.
    fn move_to(&mut self, now: f64) -> Result<(), RigError> {
        let seconds = now - self.moved;
        if seconds <= 0.0 {
            return Ok(());
        }
        let motors = self.reported.motors_at(now);
        self.moved = now;
        if seconds > LONGEST_STEP_S {
            self.plant.settle(motors)
        } else {
            self.plant.advance(seconds, motors)
        }
    }
}

impl HilPlant {
    /// Creates the rig of `plant`, whose motors are at 0.
    pub fn new(plant: Box<dyn Plant + Send>) -> Self {
        let rig = HilRig { plant, moved: 0.0, reported: BoardMotion::default() };
        Self::start(Arc::new(Mutex::new(rig)))
    }

    /// Returns the observer that informs the rig.
    pub fn observer(&self) -> HilObserver {
        let (rig, clock) = (Arc::clone(&self.ball), self.clock);
        HilObserver { rig, clock, ahead: f64::INFINITY, updated: 0.0 }
    }
}

impl RealTimeBall for Arc<Mutex<HilRig>> {
    fn move_to(&self, now: f64) -> Result<(), RigError> {
        lock(self).move_to(now)
    }

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
        rig.reported = BoardMotion { time: rig.moved, motors, ..BoardMotion::default() };
        Ok(())
    }

    /// Takes in the motion of the board's motors at a moment of the board's clock. The rig moves
    /// with the next picture.
    pub fn board_moved(&mut self, motion: BoardMotion) {
        let now = self.clock.now();
        let drifted = self.ahead + DRIFT * (now - self.updated);
        self.ahead = drifted.min(now - motion.time);
        self.updated = now;
        lock(&self.rig).reported = BoardMotion { time: motion.time + self.ahead, ..motion };
    }
}

impl Observer for HilObserver {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(BoardReport { time, motors, rates, .. }) = record.board {
            self.board_moved(BoardMotion { time, motors, rates });
        }
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

    fn plants() -> [Box<dyn Plant + Send>; 2] {
        let Task { geometry, start, .. } = Task::paper();
        let elastic = Elastic::new(geometry, ElasticParameters::default(), start).unwrap();
        [Box::new(QuasiStatic::new(geometry, start).unwrap()), Box::new(elastic)]
    }

    /// A program that was suspended for a minute goes on with its rig.
    #[test]
    fn a_rig_follows_its_motors_after_a_long_pause() {
        for plant in plants() {
            let rig = HilPlant::new(plant);
            let mut observer = rig.observer();
            observer.board_stands([0.0; MOTORS]).unwrap();
            let before = rig.ball();
            lock(&observer.rig).moved -= 60.0;
            let motors = [50.0, 0.0, 0.0];
            observer.board_moved(BoardMotion { motors, ..BoardMotion::default() });
            rig.ball.move_to(rig.now()).unwrap();
            assert!((rig.ball() - before).norm() > 0.005);
        }
    }

    /// The ball is where the motors are when the picture is taken, and not where they were when the
    /// last report came.
    #[test]
    fn a_picture_shows_the_ball_at_its_own_time() {
        for plant in plants() {
            let rig = HilPlant::new(plant);
            rig.observer().board_stands([0.0; MOTORS]).unwrap();
            let mut hil = lock(&rig.ball);
            let begin = hil.moved;
            hil.reported = BoardMotion { time: begin, motors: [0.0; 3], rates: [100.0, 0.0, 0.0] };
            hil.move_to(begin + 0.05).unwrap();
            let ahead = hil.plant.ball();
            hil.reported =
                BoardMotion { time: begin + 0.05, motors: [5.0, 0.0, 0.0], rates: [0.0; 3] };
            hil.move_to(begin + 0.051).unwrap();
            assert!((hil.plant.ball() - ahead).norm() < 5e-4, "{}", hil.plant.ball() - ahead);
            assert!((ahead - Task::paper().start).norm() > 1e-3);
        }
    }

    #[test]
    fn late_reports_do_not_shift_the_clock_of_the_board() {
        let rig = HilPlant::new(plants().into_iter().next().unwrap());
        let mut observer = rig.observer();
        observer.board_stands([0.0; MOTORS]).unwrap();
        let board_time = |rig: &HilPlant| rig.now() + 1000.0;
        observer.board_moved(BoardMotion { time: board_time(&rig), ..BoardMotion::default() });
        let late = board_time(&rig) - 0.5;
        observer.board_moved(BoardMotion { time: late, ..BoardMotion::default() });
        let reported = lock(&rig.ball).reported.time;
        assert!((reported - (late - 1000.0)).abs() < 1e-3, "{reported}");
    }
}
