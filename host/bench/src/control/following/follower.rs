//! Interface of the controllers that follow a path.

use nalgebra::Point3;
use plumb_protocol::PerMotor;
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;

/// The path's time at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// Moment, seconds after the start of the run.
    pub(super) at_s: f64,
    /// The path's time, seconds after its start. A path that waits is behind the run's time.
    pub(super) path_s: f64,
}

/// A controller that has the ball follow the path of a run.
pub(super) trait CourseFollower {
    /// Handles a frame that arrives at `now`. `age_us` is its age, µs; `ball` the measured position
    /// in metres, rig frame.
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>);
    /// Runs the motors for the tick that begins at `now`. Returns their positions at its end, full
    /// steps; + pays cable out.
    fn tick(&mut self, now: Micros) -> PerMotor<f64>;
    /// Returns the newest reading of the path's time; `None` before the controller follows.
    fn reading(&self) -> Option<Reading>;
    /// Returns the fault that has ended the drive.
    fn fault(&self) -> Option<Fault>;
}
