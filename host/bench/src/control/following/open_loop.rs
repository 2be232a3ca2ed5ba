//! The oracle of the path suites: a robot with a perfect model, without feedback.

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{ElasticParameters, GRAVITY_M_S2, Geometry};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, PerMotor};
use plumb_sim::limits::RigLimits;

use super::course::Course;
use super::follower::{CourseFollower, Reading};

/// Time between two settings of the motors, µs.
const STEP_US: u64 = 1000;
/// The same in seconds.
const STEP_S: f64 = STEP_US as f64 * 1e-6;

/// Perfect model of a rig.
struct Model {
    geometry: Geometry,
    /// Mass and stiffness; `None` for rigid cables.
    elasticity: Option<ElasticParameters>,
}

impl Model {
    /// Returns the cable lengths without stretch, in steps, that give the ball this `acceleration`
    /// (m/s²) at `ball` (metres). The damping of the stretch is left out.
    fn steps(&self, ball: &Point3<f64>, acceleration: &Vector3<f64>) -> PerMotor<f64> {
        let lengths = self.geometry.cable_lengths_m(ball);
        let stretch = self.stretch_m(ball, acceleration).unwrap_or_default();
        let step_m = self.geometry.step_lengths_m();
        std::array::from_fn(|i| (lengths[i] - stretch[i]) / step_m[i])
    }

    /// Returns the stretch of each cable, metres: T = -m J'(g ẑ + a) over the stiffness; `None` for
    /// rigid cables, and in the plane of the motors.
    fn stretch_m(&self, ball: &Point3<f64>, acceleration: &Vector3<f64>) -> Option<PerMotor<f64>> {
        let ElasticParameters { mass_kg, stiffness_n_m, .. } = self.elasticity?;
        let force = (acceleration + Vector3::z() * GRAVITY_M_S2) * mass_kg;
        let tensions = -(self.geometry.jacobian(ball)?.transpose() * force);
        Some(std::array::from_fn(|i| tensions[i] / stiffness_n_m[i]))
    }
}

/// Open loop along the path: exact inverse dynamics at every millisecond. Where a motor would turn
/// faster than its highest rate, the path slows down. The motors' accelerations have no limit.
pub(super) struct OpenLoop<'a> {
    course: &'a Course,
    model: Model,
    /// Highest rate of a motor, full steps/s.
    rate: f64,
    /// Cable lengths at the start, steps.
    start: PerMotor<f64>,
    /// Motor positions, full steps.
    motors: PerMotor<f64>,
    /// The path's time that the motors are set to.
    path_s: f64,
    /// End of the present setting.
    next: Micros,
}

impl<'a> OpenLoop<'a> {
    /// Creates the oracle of a rig whose ball rests at the path's begin.
    pub(super) fn new(
        course: &'a Course,
        geometry: Geometry,
        elasticity: Option<ElasticParameters>,
    ) -> Self {
        let model = Model { geometry, elasticity };
        let start = model.steps(&course.start(), &Vector3::zeros());
        let (motors, next) = ([0.0; MOTORS], Micros(0));
        Self { course, model, rate: RigLimits::default().rate, start, motors, path_s: 0.0, next }
    }

    /// Returns the motor positions, full steps, at a path's time that passes at `pace`.
    fn motors_at(&self, path_s: f64, pace: f64) -> PerMotor<f64> {
        let moment = self.course.at(path_s);
        let steps = self.model.steps(&moment.position, &(moment.acceleration * pace * pace));
        std::array::from_fn(|i| steps[i] - self.start[i])
    }

    /// Goes on by a step of the path's time, or by less where a motor would be too fast.
    fn advance(&mut self) {
        let [now, then] = [0.0, STEP_S].map(|ahead| self.motors_at(self.path_s + ahead, 1.0));
        let fastest = (0..MOTORS).map(|i| (then[i] - now[i]).abs() / STEP_S).fold(0.0, f64::max);
        let pace = if fastest > self.rate { self.rate / fastest } else { 1.0 };
        self.path_s += pace * STEP_S;
        self.motors = self.motors_at(self.path_s, pace);
    }
}

impl CourseFollower for OpenLoop<'_> {
    fn on_position(&mut self, _: Micros, _: u32, _: Option<Point3<f64>>) {}

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        if now >= self.next {
            self.advance();
            self.next = Micros(now.0 + STEP_US);
        }
        self.motors
    }

    fn reading(&self) -> Option<Reading> {
        Some(Reading { at_s: self.next.0 as f64 * 1e-6, path_s: self.path_s })
    }

    fn fault(&self) -> Option<Fault> {
        None
    }
}
