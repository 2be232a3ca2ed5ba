//! Controllers with laws in `f64`: the board's servo and planner, with another law in them.

use nalgebra::Point3;
use plumb_core::MotorRates;
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_core::law_worker::LawResponse;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_core::servo::{BallPosition, MotorPositions, ReferenceTick, Servo};
use plumb_protocol::PerMotor;
use plumb_protocol::config::Config;
use plumb_protocol::message::{Fault, Reference, ReferenceState};
use plumb_protocol::units::{Micros, Point, Steps16};

use super::simulate::Controller;

/// Any [`Law`] in the board's own [`Servo`] and [`Planner`]. With the board's law in it, the
/// controller does what a board does, up to rounding.
pub(super) struct LawController {
    servo: Servo<BoxedLaw>,
    /// The law, where the board's configuration has a deferred one.
    deferred: Option<BoxedLaw>,
    planner: Planner,
    params: Params,
    config: Config,
    target: Point,
    reached: bool,
    /// Whether the drive has ended because positions failed to come for too long.
    lost: bool,
    /// Whether a lost drive has begun again.
    resumed: bool,
    /// Whether the setpoint is a new one.
    changed: bool,
    /// Rates that the planner has.
    planned: MotorRates,
    /// Fault of a guard. A drive to a target that rests goes on in spite of it.
    guarded: Option<Fault>,
}

/// A law of any kind.
struct BoxedLaw(Box<dyn Law>);

impl Law for BoxedLaw {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        self.0.update(measurement)
    }
}

impl LawController {
    /// Creates the controller of a board with this configuration, from which `params` were made. It
    /// drives the ball to `target` with `law`.
    pub(super) fn new(
        law: Box<dyn Law>,
        (config, params): (Config, &Params),
        target: Point,
    ) -> Self {
        let mut planner = Planner::default();
        planner.configure(params);
        let law = Some(BoxedLaw(law));
        let is_deferred = params.deferred_law().is_some();
        let (inline, deferred) = if is_deferred { (None, law) } else { (law, None) };
        let mut servo = Servo::new(inline);
        servo.begin_drive(Micros(0), &planner);
        Self {
            servo,
            deferred,
            planner,
            params: *params,
            config,
            target,
            reached: false,
            lost: false,
            resumed: false,
            changed: false,
            planned: MotorRates::default(),
            guarded: None,
        }
    }

    /// Follows a path, or goes on with its next part. The reference begins at the target.
    pub(super) fn follow(&mut self, now: Micros, reference: &Reference) {
        if self.servo.follow_on(now, reference).is_none() {
            self.servo.follow(now, self.target, reference);
        }
    }

    /// Returns the state of the reference; `None` before [`follow`](Self::follow).
    pub(super) fn reference(&self, now: Micros) -> Option<ReferenceState> {
        self.servo.reference_state(now)
    }

    /// Returns the fault with which a board would have stopped.
    pub(super) fn fault(&self) -> Option<Fault> {
        self.guarded.or(self.lost.then_some(Fault::PositionLost))
    }

    /// Begins a lost drive again once the motors stand and the ball is seen, as the bench does with
    /// a board.
    fn resume(&mut self, now: Micros) {
        if self.lost && !self.planner.moving() {
            (self.lost, self.resumed) = (false, true);
            self.servo.end_drive(now);
            self.servo.begin_drive(now, &self.planner);
        }
    }

    /// Makes the law request that is due after the tick at `now`, and responds to it at once.
    fn respond(&mut self, now: Micros) {
        let target = (!self.lost).then_some(self.target);
        self.servo.make_request(now, target, &self.planner, &self.params);
        if let (Some(request), Some(law)) = (self.servo.take_request(), &mut self.deferred) {
            let setpoint = law.update(&request.measurement);
            let tensions = law.tensions();
            self.servo.on_response(&LawResponse { number: request.number, setpoint, tensions });
        }
    }

    /// Returns the setpoint at `now`.
    fn setpoint(&mut self, now: Micros) -> Setpoint {
        self.lost |= self.servo.position_lost(now, &self.params);
        if self.lost { Setpoint::default() } else { self.servo.setpoint(now, &self.params) }
    }
}

impl Controller for LawController {
    fn set_target(&mut self, now: Micros, target: Point3<f64>) {
        // A place that the protocol cannot name is refused before the run.
        self.target = Point::from_metres(target.into()).unwrap_or(self.target);
        self.reached = false;
        self.servo.leave_target(now, &self.params);
        self.servo.change_target(now);
        self.servo.update_guards(now, &self.planner);
    }

    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        let point = ball.and_then(|ball| Point::from_metres(ball.into()));
        let Some(point) = point.filter(|point| self.config.workspace.contains(*point)) else {
            return;
        };
        self.resume(now);
        let captured = now.back(u64::from(age_us));
        let position = BallPosition { captured, ball: point.micrometres(), covariance: None };
        let motors =
            MotorPositions { present: self.planner.positions(), ahead: self.planner.reference() };
        let target = (!self.lost).then_some(self.target);
        self.servo.on_position(now, &position, target, &motors, &self.params);
        if self.lost {
            return;
        }
        self.changed |= self.deferred.is_none();
        let progress = self.servo.check_progress(now, self.target, &self.planner, &self.params);
        self.reached |= progress.reached;
        self.guarded = self.guarded.or(progress.fault);
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        self.changed |= self.servo.apply_response(now, &self.params) == Ok(true);
        let setpoint = self.setpoint(now);
        // The board sets the rates only after an event, which rounds less than in every tick.
        if self.changed || setpoint.rates != self.planned {
            self.planner.follow(&setpoint);
            (self.changed, self.planned) = (false, setpoint.rates);
        }
        self.planner.tick();
        let _ = self.servo.advance_reference(now, ReferenceTick::FREE, &self.params);
        self.respond(now);
        self.planner.positions().map(|p| Steps16(p).to_si())
    }

    fn reached(&self) -> bool {
        self.reached
    }

    fn failed(&self) -> bool {
        false
    }

    fn resumed(&self) -> bool {
        self.resumed
    }
}
