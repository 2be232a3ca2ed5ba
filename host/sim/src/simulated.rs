//! A camera that looks at a rig that is not there: synthetic pictures of wherever its ball is, on
//! time.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_cameras::source::{BoxedError, CameraSource, SourceError};
use plumb_cameras::toml_file::Finite;
use plumb_emulator::rig::{Geometry, Plant, RigError};
use plumb_emulator::{EmulatedBoard, Served};
use plumb_protocol::units::{Micros, Steps16};
use plumb_runtime::link::LinkError;
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::Simulation;
use plumb_vision::frame::RgbdFrame;
use thiserror::Error;

use super::synthetic::{Scene, SyntheticCamera, SyntheticError};

/// Why there is no picture of a simulated rig.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The rig cannot follow its motors; no picture comes any more.
    #[error("the simulated rig: {0}")]
    Rig(#[from] RigError),
    /// The picture could not be rendered.
    #[error(transparent)]
    Synthetic(#[from] SyntheticError),
}

impl From<SimulationError> for SourceError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Rig(_) => Self::over(error),
            SimulationError::Synthetic(_) => Self::new(error),
        }
    }
}

impl From<SimulationError> for LinkError {
    fn from(error: SimulationError) -> Self {
        Self::Other(error.into())
    }
}

/// Returns the geometry of a rig file's simulated rig.
///
/// # Errors
/// Where its values describe no rig.
pub fn geometry(simulation: &Simulation) -> Result<Geometry, RigError> {
    Geometry::new(simulation.motors(), simulation.pulley_radii.map(Finite::get))
}

/// Where a simulated rig's ball is, and the clock that goes with it.
pub trait SimClock {
    /// The time, seconds.
    fn now(&self) -> f64;

    /// Lets time pass until `time`, seconds; at once where that is over.
    ///
    /// # Errors
    /// Where the rig cannot follow its motors.
    fn wait_until(&mut self, time: f64) -> Result<(), RigError>;

    /// The ball's centre now, metres in the rig frame.
    fn ball(&self) -> Point3<f64>;
}

/// The rig of an emulated board in this process, in virtual time.
pub struct VirtualRig {
    board: Rc<RefCell<EmulatedBoard>>,
}

impl VirtualRig {
    /// The rig that `board` moves; `None` where it moves none.
    pub fn new(board: Rc<RefCell<EmulatedBoard>>) -> Option<Self> {
        board.borrow().ball()?;
        Some(Self { board })
    }
}

impl SimClock for VirtualRig {
    fn now(&self) -> f64 {
        self.board.borrow().now().0 as f64 * 1e-6
    }

    fn wait_until(&mut self, time: f64) -> Result<(), RigError> {
        self.board.borrow_mut().run_to(Micros((time * 1e6) as u64))
    }

    fn ball(&self) -> Point3<f64> {
        self.board.borrow().ball().unwrap_or_else(Point3::origin)
    }
}

/// The rig of an emulated board in another thread, in real time.
pub struct ServedRig {
    served: Rc<Served>,
    clock: RealTime,
}

impl ServedRig {
    /// The rig that the served board moves; `None` where it moves none.
    pub fn new(served: Rc<Served>) -> Option<Self> {
        served.board().ball()?;
        Some(Self { served, clock: RealTime::start() })
    }
}

impl SimClock for ServedRig {
    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn wait_until(&mut self, time: f64) -> Result<(), RigError> {
        self.clock.wait_until(time);
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.served.board().ball().unwrap_or_else(Point3::origin)
    }
}

/// A rig in this process that follows what any board, real or not, says of its motors, in real
/// time: a board is tried without a rig.
pub struct HilPlant {
    rig: Rc<RefCell<HilRig>>,
    clock: RealTime,
}

/// Observer that moves the rig of a [`HilPlant`] to the motor positions of the telemetry. A
/// rig that cannot follow ends the run.
pub struct Follower {
    rig: Rc<RefCell<HilRig>>,
    clock: RealTime,
    failure: Option<SimulationError>,
}

struct HilRig {
    plant: Box<dyn Plant>,
    /// Where the board's motors were when the rig began to follow, full steps.
    zero: Option<[f64; 3]>,
    /// When it last moved, seconds on its clock.
    moved: f64,
}

impl HilPlant {
    /// Lets `plant` follow; it starts where it is, whatever the motors' positions are at first.
    pub fn new(plant: Box<dyn Plant>) -> Self {
        let rig = HilRig { plant, zero: None, moved: 0.0 };
        Self { rig: Rc::new(RefCell::new(rig)), clock: RealTime::start() }
    }

    /// Returns the observer that moves the rig.
    pub fn follower(&self) -> Follower {
        Follower { rig: Rc::clone(&self.rig), clock: self.clock, failure: None }
    }
}

impl SimClock for HilPlant {
    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn wait_until(&mut self, time: f64) -> Result<(), RigError> {
        self.clock.wait_until(time);
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.rig.borrow().plant.ball()
    }
}

impl Follower {
    /// Moves the rig to these motor positions (full steps since the board's start).
    ///
    /// # Errors
    /// Where the rig cannot follow them.
    pub fn board_moved(&mut self, motors: [f64; 3]) -> Result<(), SimulationError> {
        let mut rig = self.rig.borrow_mut();
        let zero = *rig.zero.get_or_insert(motors);
        let now = self.clock.now();
        let seconds = now - rig.moved;
        rig.plant.advance(seconds, [0, 1, 2].map(|i| motors[i] - zero[i]))?;
        rig.moved = now;
        Ok(())
    }
}

impl Observer for Follower {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(telemetry) = &record.telemetry {
            self.failure = self.board_moved(telemetry.motors.map(Steps16::to_si)).err();
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.failure.take().map(Into::into)
    }
}

/// Seconds since it was started.
#[derive(Debug, Clone, Copy)]
struct RealTime(Instant);

impl RealTime {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn now(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    fn wait_until(&self, time: f64) {
        if let Ok(span) = Duration::try_from_secs_f64(time) {
            thread::sleep((self.0 + span).saturating_duration_since(Instant::now()));
        }
    }
}

/// When a simulated camera takes pictures and when they arrive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Pictures a second.
    pub rate: f64,
    /// From taking a picture to its arrival at the host, seconds: exposure, transfer, driver.
    pub latency: f64,
}

impl Default for Timing {
    /// 30 pictures/s, 45 ms late, as a PrimeSense camera at 640x480.
    fn default() -> Self {
        Self { rate: 30.0, latency: 0.045 }
    }
}

/// A [`SyntheticCamera`] on a [`SimClock`].
pub struct SimulatedCamera<C> {
    rig: C,
    camera: SyntheticCamera,
    motors: [Point3<f64>; 3],
    timing: Timing,
    next_capture: f64,
    /// Taken but not yet arrived: when, and where the ball was.
    under_way: VecDeque<(f64, Point3<f64>)>,
}

impl<C: SimClock> SimulatedCamera<C> {
    /// Looks at `rig`, whose cables come from `motors` (metres, rig frame).
    pub fn new(rig: C, camera: SyntheticCamera, motors: [Point3<f64>; 3], timing: Timing) -> Self {
        let next_capture = rig.now();
        Self { rig, camera, motors, timing, next_capture, under_way: VecDeque::new() }
    }

    /// The rig, to look at.
    pub fn rig(&self) -> &C {
        &self.rig
    }

    /// Lets time pass to the next picture's exposure and takes it.
    fn capture(&mut self) -> Result<(), RigError> {
        self.rig.wait_until(self.next_capture)?;
        let now = self.rig.now();
        self.under_way.push_back((now, self.rig.ball()));
        // A host that is too slow misses pictures; it does not get them later.
        let period = 1.0 / self.timing.rate;
        self.next_capture +=
            period * ((now - self.next_capture) / period).floor().max(0.0) + period;
        Ok(())
    }

    /// Lets time pass until the next picture arrives, and renders it.
    fn next_picture(&mut self) -> Result<RgbdFrame, SimulationError> {
        loop {
            if let Some(&(taken, ball)) = self.under_way.front()
                && taken + self.timing.latency <= self.next_capture
            {
                self.under_way.pop_front();
                self.rig.wait_until(taken + self.timing.latency)?;
                return Ok(self.camera.render(taken, &Scene::rig(ball, self.motors))?);
            }
            self.capture()?;
        }
    }
}

impl<C: SimClock> CameraSource for SimulatedCamera<C> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        Ok(Some(self.next_picture()?))
    }

    fn now(&self) -> f64 {
        self.rig.now()
    }

    fn is_live(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error;

    use plumb_emulator::rig::{QuasiStatic, Task};

    use super::*;

    #[test]
    fn only_a_rig_that_cannot_follow_ends_the_pictures() {
        let slack = RigError::OutOfRange { name: "cable", value: -1.0, allowed: "above 0" };
        let rig = SourceError::from(SimulationError::Rig(slack));
        assert!(rig.is_over());
        assert!(rig.to_string().starts_with("the simulated rig: "), "{rig}");
        assert!(rig.source().is_some_and(|error| error.is::<SimulationError>()));
        let value = SyntheticError::Value { what: "it", value: -1.0, must: "be above 0" };
        assert!(!SourceError::from(SimulationError::Synthetic(value)).is_over());
    }

    #[test]
    fn a_rig_follows_the_motors_from_where_they_are_at_first() {
        let Task { geometry, start, .. } = Task::paper();
        let rig = HilPlant::new(Box::new(QuasiStatic::new(geometry, start).unwrap()));
        let (mut follower, before) = (rig.follower(), rig.ball());
        follower.board_moved([100.0, -50.0, 7.0]).unwrap();
        assert_eq!(rig.ball(), before);
        follower.board_moved([120.0, -50.0, 7.0]).unwrap();
        assert!((rig.ball() - before).norm() > 1e-3, "{}", rig.ball());
    }
}
