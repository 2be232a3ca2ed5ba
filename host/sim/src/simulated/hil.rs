//! Hardware in the loop: a simulated rig on a board's motor positions.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point3;
use plumb_emulator::plant::{LONGEST_STEP_S, Plant, RigError};
use plumb_protocol::{MOTORS, PerMotor};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::observer::{FrameRecord, Observer};

use super::clock::{RealTimeBall, RealTimeRig, RigClock, Seen};
use super::error::SimulationError;
use crate::led_port::LedPort;

/// Longest time for which the motors are assumed to go on as reported, seconds. On a busy computer
/// a report may be older.
const MAX_AHEAD_S: f64 = 0.1;
/// Reports that are kept: those of a second at 30 pictures a second.
const REPORTS: usize = 30;
/// Rate at which the clock of the board may be slower than that of the computer: five times what
/// quartzes differ by.
const DRIFT: f64 = 5e-4;

/// Hardware in the loop: a simulated rig that follows the motor positions of any board, real or
/// emulated, in real time or on the clock of an emulated board. The rig's start is where the
/// board's motors are at 0: a second run goes on where the first one left the ball.
pub type HilPlant = RealTimeRig<Arc<Mutex<HilRig>>>;

/// Observer that tells the rig of a [`HilPlant`] what the telemetry says of the motors.
pub struct HilObserver {
    rig: Arc<Mutex<HilRig>>,
    clock: RigClock,
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
    /// The motors at moments of the computer's clock, the oldest first; never empty.
    reported: VecDeque<BoardMotion>,
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
    fn motors_after(&self, time: f64) -> PerMotor<f64> {
        let ahead = (time - self.time).clamp(0.0, MAX_AHEAD_S);
        std::array::from_fn(|k| self.motors[k] + ahead * self.rates[k])
    }

    /// Returns where the motors were at `time`, seconds, between this report and a `later` one.
    fn motors_between(&self, later: &Self, time: f64) -> PerMotor<f64> {
        let part = ((time - self.time) / (later.time - self.time)).clamp(0.0, 1.0);
        std::array::from_fn(|k| self.motors[k] + part * (later.motors[k] - self.motors[k]))
    }
}

impl HilRig {
    /// Adds a report. One that is no newer than the last is ignored.
    fn report(&mut self, motion: BoardMotion) {
        if self.reported.back().is_some_and(|last| motion.time <= last.time) {
            return;
        }
        if self.reported.len() == REPORTS {
            self.reported.pop_front();
        }
        self.reported.push_back(motion);
    }

    /// Returns where the motors were at `time`, seconds.
    fn motors_at(&self, time: f64) -> PerMotor<f64> {
        let after = self.reported.partition_point(|report| report.time <= time);
        match (after.checked_sub(1).map(|before| &self.reported[before]), self.reported.get(after))
        {
            (Some(before), Some(later)) => before.motors_between(later, time),
            (Some(last), None) => last.motors_after(time),
            (None, first) => first.map_or([0.0; MOTORS], |first| first.motors),
        }
    }

    /// Moves the rig to `time`, seconds. After a longer time than the rig steps at once, the ball
    /// is at rest: the program was suspended, or prepared its first frame on a busy computer.
    fn move_to(&mut self, time: f64) -> Result<(), RigError> {
        let seconds = time - self.moved;
        if seconds <= 0.0 {
            return Ok(());
        }
        let motors = self.motors_at(time);
        self.moved = time;
        if seconds > LONGEST_STEP_S {
            self.plant.settle(motors)
        } else {
            self.plant.advance(seconds, motors)
        }
    }
}

impl HilPlant {
    /// Creates the rig of `plant`, whose motors are at 0: on the clock of the emulated board at
    /// `port`, or in real time.
    pub fn new(plant: Box<dyn Plant + Send>, port: Option<LedPort>) -> Self {
        let reported = VecDeque::from([BoardMotion::default()]);
        let rig = HilRig { plant, moved: 0.0, reported };
        let ball = Arc::new(Mutex::new(rig));
        let clock = port.map_or_else(RigClock::start, RigClock::Led);
        Self { ball, clock }
    }

    /// Returns the observer that informs the rig.
    pub fn observer(&self) -> HilObserver {
        let (rig, clock) = (Arc::clone(&self.ball), self.clock.clone());
        HilObserver { rig, clock, ahead: f64::INFINITY, updated: 0.0 }
    }
}

impl RealTimeBall for Arc<Mutex<HilRig>> {
    /// The telemetry that tells where the motors were comes later than the picture is taken, and
    /// before it arrives.
    fn seen_at(&self, time: f64) -> Result<Option<Seen>, RigError> {
        let mut rig = lock(self);
        rig.move_to(time)?;
        let (ball, tensions) = (rig.plant.ball(), rig.plant.tensions_per_weight());
        Ok(Some(Seen { ball, tensions }))
    }

    fn ball(&self) -> Point3<f64> {
        lock(self).plant.ball()
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        lock(self).plant.tensions_per_weight()
    }
}

impl HilObserver {
    /// Returns the place of the ball, metres in the rig frame.
    pub fn ball(&self) -> Point3<f64> {
        self.rig.ball()
    }

    /// Places the rig at the motor positions of a board that stands (full steps from the zero of
    /// travel).
    ///
    /// # Errors
    /// If the rig cannot follow them.
    pub fn board_stands(&mut self, motors: PerMotor<f64>) -> Result<(), SimulationError> {
        let mut rig = lock(&self.rig);
        rig.plant.settle(motors)?;
        rig.moved = self.clock.now();
        let report = BoardMotion { time: rig.moved, motors, ..BoardMotion::default() };
        rig.reported = VecDeque::from([report]);
        Ok(())
    }

    /// Takes in the motion of the board's motors at a moment of the board's clock. The rig moves
    /// when a picture arrives.
    pub fn board_moved(&mut self, motion: BoardMotion) {
        let now = self.clock.now();
        let drifted = self.ahead + DRIFT * (now - self.updated);
        self.ahead = drifted.min(now - motion.time);
        self.updated = now;
        lock(&self.rig).report(BoardMotion { time: motion.time + self.ahead, ..motion });
    }
}

impl Observer for HilObserver {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(BoardReport { time, motors, rates, .. }) = record.board {
            let [motors, rates] = [motors, rates].map(|list| list.steppable(0.0));
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
            let rig = HilPlant::new(plant, None);
            let mut observer = rig.observer();
            observer.board_stands([0.0; MOTORS]).unwrap();
            let before = rig.ball();
            lock(&observer.rig).moved -= 60.0;
            let motors = [50.0, 0.0, 0.0];
            observer.board_moved(BoardMotion { motors, ..BoardMotion::default() });
            rig.seen_at(rig.now()).unwrap();
            assert!((rig.ball() - before).norm() > 0.005);
        }
    }

    /// The ball is where the motors were when the picture was taken: between two reports, and
    /// behind the last one.
    #[test]
    fn a_picture_shows_the_ball_at_its_own_time() {
        let rig = HilPlant::new(plants().into_iter().next().unwrap(), None);
        rig.observer().board_stands([0.0; MOTORS]).unwrap();
        let mut hil = lock(&rig.ball);
        let begin = hil.moved;
        let report = |time: f64, motor: f64, rate: f64| BoardMotion {
            time: begin + time,
            motors: [motor, 0.0, 0.0],
            rates: [rate, 0.0, 0.0],
        };
        hil.report(report(0.04, 4.0, 100.0));
        // It came late.
        hil.report(report(0.03, 0.0, 0.0));
        let motor_at = |hil: &HilRig, time: f64| hil.motors_at(begin + time)[0];
        for (time, motor) in [(-0.1, 0.0), (0.02, 2.0), (0.04, 4.0), (0.06, 6.0), (9.0, 14.0)] {
            assert!((motor_at(&hil, time) - motor).abs() < 1e-9, "{}", motor_at(&hil, time));
        }
        hil.report(report(0.08, 6.0, 0.0));
        assert!((motor_at(&hil, 0.06) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn late_reports_do_not_shift_the_clock_of_the_board() {
        let rig = HilPlant::new(plants().into_iter().next().unwrap(), None);
        let mut observer = rig.observer();
        observer.board_stands([0.0; MOTORS]).unwrap();
        let board_time = |rig: &HilPlant| rig.now() + 1000.0;
        observer.board_moved(BoardMotion { time: board_time(&rig), ..BoardMotion::default() });
        let late = board_time(&rig) - 0.5;
        observer.board_moved(BoardMotion { time: late, ..BoardMotion::default() });
        assert!((late + observer.ahead - (late - 1000.0)).abs() < 1e-3, "{}", observer.ahead);
    }
}
