//! The control loop between the ball's positions and the motors' setpoint, with its guards.
//!
//! ```text
//! position -> BallTracker -> law -> setpoint                     (an inline law, at once)
//!                         -> LawClient -> LawWorker -> setpoint  (a deferred law, ticks later)
//!                         -> ArrivalDetector, Guards
//! ```
//!
//! A [`Servo`] has no commands and no states. The board gives it positions and the present target,
//! and reads the setpoint; the control benchmarks do the same with laws of their own.

mod guards;
mod reference;
mod tracker;

use plumb_protocol::dimension::{AXES, MOTORS, PerAxis, PerMotor};
use plumb_protocol::message::{Fault, Reference, ReferenceState};
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{
    Covariance, Micrometres, Micros, Milliseconds, Point, RelativeTension,
};
use reference::ReferenceTracker;

use crate::law::{Aim, InlineLaw, Law, Measurement, Setpoint, variances};
use crate::law_worker::{LawClient, LawRequest, LawResponse};
use crate::params::Params;
use crate::plan::{Planner, mean_lag_us};
use crate::vector::per_axis;

pub use guards::{DriveState, Guards, MotorsOfDrive};
pub use tracker::{ArrivalDetector, BallTracker, error, magnitude};

/// A position of the ball, inside the workspace.
#[derive(Debug, Clone, Copy)]
pub struct BallPosition {
    /// When the frame was captured.
    pub captured: Micros,
    /// Position of the ball, µm, within ±4 m.
    pub ball: PerAxis<i32>,
    /// Covariance of the position; `None` if the host did not send one.
    pub covariance: Option<Covariance>,
}

/// Motor positions that an inline law gets with a position of the ball, Q4 steps.
#[derive(Debug, Clone, Copy)]
pub struct MotorPositions {
    /// See [`Measurement::motors`].
    pub present: PerMotor<i32>,
    /// See [`Measurement::motors_ahead`].
    pub ahead: PerMotor<i32>,
}

impl MotorPositions {
    /// Zeros, for laws that use the ball's position alone. The board's inline laws do.
    pub const UNUSED: Self = Self { present: [0; MOTORS], ahead: [0; MOTORS] };
}

/// Result of [`Servo::check_progress`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriveProgress {
    /// Whether the target counts as reached.
    pub reached: bool,
    /// Fault of a guard, which stops the drive.
    pub fault: Option<Fault>,
}

/// What a tick leaves to the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceTick {
    /// Whether the tick has other work: the next state waits if it can.
    pub is_busy: bool,
    /// Whether the drivers take pulses. Until then a path that waits stands.
    pub can_move: bool,
}

impl ReferenceTick {
    /// No other work, and drivers that take pulses.
    pub const FREE: Self = Self { is_busy: false, can_move: true };
}

/// The response of a deferred law was not there in its tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawLate;

/// The control loop: it tracks the ball, runs the law, and guards the drive.
///
/// A drive lasts from the first target at rest to the stop. Its guards and the tracker outlive a
/// change of the target. The travel limits are guarded by the [`Planner`], since they hold for jogs
/// too.
#[derive(Debug, Clone)]
pub struct Servo<L = InlineLaw> {
    tracker: BallTracker,
    /// The law, where it is an inline one.
    law: Option<L>,
    /// Client of the law worker, where the law is a deferred one.
    client: LawClient,
    /// Number of the law request for the present target; `None` where none is open.
    request: Option<u32>,
    /// Setpoint of the law, within the motors' limits.
    setpoint: Setpoint,
    /// When the setpoint took effect.
    setpoint_since: Micros,
    arrival: ArrivalDetector,
    /// When the drive began.
    drive_since: Micros,
    guards: Guards,
    /// Positions of motors at rest with which a drive has begun in this tick, Q4 steps.
    begun_at: Option<PerMotor<i32>>,
    /// Way from the ball to a target that was replaced in this tick, µm.
    left_way: Option<PerAxis<i32>>,
    /// See [`Servo::tensions`].
    tensions: Option<PerMotor<RelativeTension>>,
    /// The reference, while the drive follows one.
    reference: Option<ReferenceTracker>,
}

/// Returns `limit` in µs.
pub(crate) fn limit_us(limit: Milliseconds) -> u64 {
    // 16 + 10 bits: a product of 32 bits costs the chip one clock, one of 64 bits forty.
    u64::from(u32::from(limit.0) * 1000)
}

/// Returns the age of a frame that was `captured` then, µs; saturates after an hour.
fn age_us(now: Micros, captured: Micros) -> u32 {
    now.since(captured).min(u64::from(u32::MAX)) as u32
}

/// Returns the time without a position after which the rates are reduced, µs: two fifths of the
/// deadline, which at 500 ms and 30 Hz is six frames.
pub(crate) fn coasting_us(deadline: Milliseconds) -> u64 {
    u64::from(u32::from(deadline.0) * 400)
}

impl<L: Law> Servo<L> {
    /// Creates a servo that has seen nothing, with an inline law, or none.
    pub fn new(law: Option<L>) -> Self {
        Self {
            tracker: BallTracker::default(),
            law,
            client: LawClient::default(),
            request: None,
            setpoint: Setpoint::default(),
            setpoint_since: Micros(0),
            arrival: ArrivalDetector::default(),
            drive_since: Micros(0),
            guards: Guards::default(),
            begun_at: None,
            left_way: None,
            tensions: None,
            reference: None,
        }
    }

    /// Replaces the law (`None`: a deferred one) and forgets the ball, which was judged by another
    /// workspace. The law worker makes its law anew with the next request.
    pub fn configure(&mut self, law: Option<L>) {
        self.law = law;
        self.tracker = BallTracker::default();
        self.client.reset();
    }

    /// Makes the law anew with the next request, with this `prior`.
    pub(crate) fn know(&mut self, prior: Prior) {
        self.client.know(Some(prior));
    }

    /// Returns whether the motors were at `positions` (Q4 steps) when the ball was last seen, up to
    /// half a second before `now`.
    fn was_seen_at(&self, positions: PerMotor<i32>, now: Micros, planner: &Planner) -> bool {
        let stood = |captured| planner.positions_ago(age_us(now, captured)) == positions;
        self.tracker.captured().is_none_or(stood)
    }

    /// Begins a drive.
    pub fn begin_drive(&mut self, now: Micros, planner: &Planner) {
        self.begun_at = (!planner.moving()).then(|| planner.positions());
        self.drive_since = now;
        self.tensions = None;
        self.change_target(now);
    }

    /// Begins with another target of the same drive, from zero rates on.
    pub fn change_target(&mut self, now: Micros) {
        self.setpoint = Setpoint::default();
        self.setpoint_since = now;
        self.request = None;
        self.arrival = ArrivalDetector::default();
        self.reference = None;
    }

    /// Notes that the drive's target is about to be replaced at `now`. The ball goes on its way to
    /// it until the motors have changed theirs.
    pub fn leave_target(&mut self, now: Micros, params: &Params) {
        let Some(ball) = self.tracker.filtered() else { return };
        let ahead = match &self.reference {
            Some(reference) => Some(reference.aim(now, params).a_second_later()),
            None => self.guards.last_target().map(Point::micrometres),
        };
        let way = ahead.map(|ahead| per_axis(|i| ahead[i] - ball[i]));
        self.left_way = self.left_way.or(way);
    }

    /// Tells the guards of a drive that has begun, and of a target that was replaced; call in the
    /// second half of the tick at `now`, since it takes the time of several divisions. The guards
    /// start anew at standstill only: while motors turn from the last drive, or the ball was last
    /// seen while they did, they go on.
    pub fn update_guards(&mut self, now: Micros, planner: &Planner) {
        let left_way = self.left_way.take();
        let begun_at = self.begun_at.take();
        if begun_at.is_some_and(|positions| self.was_seen_at(positions, now, planner)) {
            self.guards.reset();
        } else if let Some(way) = left_way {
            self.guards.note_change(now, way, &planner.run_out());
        }
    }

    /// Ends the drive, so that the guards start anew with the next one even in motion.
    pub fn end_drive(&mut self, now: Micros) {
        self.drive_since = now;
        self.guards.reset();
    }

    /// Takes in a position that arrived at `now`. With a target, an inline law computes the
    /// setpoint from it, and a deferred law gets it with the next request.
    pub fn on_position(
        &mut self,
        now: Micros,
        position: &BallPosition,
        target: Option<Point>,
        motors: &MotorPositions,
        params: &Params,
    ) {
        let BallPosition { captured, ball, covariance } = *position;
        self.tracker.update(captured, ball);
        let Some(target) = target else { return };
        if params.deferred_law().is_some() {
            self.client.on_position(captured, ball, covariance);
        } else if let Some(law) = &mut self.law {
            let aim = match self.reference.as_ref() {
                Some(reference) if !law.uses_velocity() => reference.place(now, params),
                reference => aim(reference, target, now, params),
            };
            let setpoint = law.update(&Measurement {
                ball,
                variances: variances(covariance),
                motors: motors.present,
                motors_before: [motors.present; 2],
                motors_ahead: motors.ahead,
                target: aim.position,
                velocity: aim.velocity,
            });
            self.set_setpoint(now, setpoint, params);
        }
    }

    /// Sets the setpoint from `now` on, within the motors' limits.
    fn set_setpoint(&mut self, now: Micros, setpoint: Setpoint, params: &Params) {
        self.setpoint = Setpoint { rates: setpoint.rates.within(params.max_rates()), ..setpoint };
        self.setpoint_since = now;
        if let Some(reference) = &mut self.reference {
            reference.set_room(setpoint.room);
        }
    }

    /// Checks the filtered position after a position was taken in. Call once for each position.
    pub fn check_progress(
        &mut self,
        now: Micros,
        target: Point,
        planner: &Planner,
        params: &Params,
    ) -> DriveProgress {
        let Some(filtered) = self.tracker.filtered() else { return DriveProgress::default() };
        let captured = self.last_seen();
        if let Some(reference) = &mut self.reference {
            reference.smooth(captured);
        }
        let (target, place, is_final) = match &self.reference {
            Some(reference) => (
                reference.smoothed(),
                Point(reference.position(captured).map(Micrometres)),
                reference.has_arrived(captured),
            ),
            None => (target, target, true),
        };
        let motors = MotorsOfDrive {
            present: planner.positions(),
            at_capture: planner.positions_ago(age_us(now, captured)),
        };
        let state = DriveState::new(captured, filtered, target, motors);
        self.arrival.observe(error(self.tracker.inlier(), place), &params.config.reached);
        DriveProgress {
            reached: is_final && self.arrival.has_arrived(&params.config.reached),
            fault: self.guards.update(now, &state, params),
        }
    }

    /// Returns the setpoint at `now`. While positions fail to come, it is the setpoint of the
    /// moment when that began to count, at reduced rates; after their deadline it is standstill.
    pub fn setpoint(&self, now: Micros, params: &Params) -> Setpoint {
        let coasting = Micros(self.last_seen().0 + coasting_us(params.config.deadlines.position));
        if now <= coasting {
            return self.setpoint.after(now.since(self.setpoint_since));
        }
        if now.since(self.last_seen()) > limit_us(params.config.deadlines.position) {
            return Setpoint::default();
        }
        let setpoint = self.setpoint.after(coasting.since(self.setpoint_since));
        Setpoint { rates: setpoint.rates.coasting(), ..setpoint }
    }

    /// Returns when the setpoint took effect and how long it holds, µs.
    pub(crate) fn setpoint_validity(&self) -> (Micros, u64) {
        (self.setpoint_since, self.setpoint.valid_us.into())
    }

    /// Returns when the ball was last seen; not before the drive began.
    pub(crate) fn last_seen(&self) -> Micros {
        let since = self.drive_since;
        self.tracker.captured().map_or(since, |captured| captured.max(since))
    }

    /// Checks whether no position has come for so long that the drive is given up.
    pub fn position_lost(&self, now: Micros, params: &Params) -> bool {
        now.since(self.last_seen()) > self.patience_us(params)
    }

    /// Returns the tracker.
    pub fn tracker(&self) -> &BallTracker {
        &self.tracker
    }

    /// Returns the tracker, for counts of the ball outside the workspace.
    pub(crate) fn tracker_mut(&mut self) -> &mut BallTracker {
        &mut self.tracker
    }

    /// Returns the law's estimate of the cables' tensions in this drive; `None` before its first
    /// response, and with a law without an estimate.
    pub fn tensions(&self) -> Option<PerMotor<RelativeTension>> {
        self.tensions
    }

    /// Returns the client of the law worker.
    #[inline]
    pub(crate) fn client(&self) -> &LawClient {
        &self.client
    }

    /// Makes a law request from the newest position, where one waits and no request is open; call
    /// after the planning of the tick at `now`. Without a target the position is discarded.
    /// Returns whether a request was made.
    pub fn make_request(
        &mut self,
        now: Micros,
        target: Option<Point>,
        planner: &Planner,
        params: &Params,
    ) -> bool {
        let Some(target) = target else {
            self.client.discard_pending();
            return false;
        };
        let aim = |due| aim(self.reference.as_ref(), target, due, params);
        let ticks = match self.reference {
            Some(_) => params.law_ticks.map_or(0, |ticks| ticks.following),
            None => params.law_ticks.map_or(0, |ticks| ticks.standing),
        };
        let number = self.client.make_request(now, ticks.into(), aim, planner, params);
        if number.is_some() {
            self.request = number;
        }
        number.is_some()
    }

    /// Returns the request for the law worker, once.
    #[inline]
    pub fn take_request(&mut self) -> Option<LawRequest> {
        self.client.take_request()
    }

    /// Takes in the law worker's response. It takes effect in its tick.
    pub fn on_response(&mut self, response: &LawResponse) {
        self.client.on_response(response);
    }

    /// Applies the response that takes effect at `now`, where it is for the present target. Returns
    /// whether the setpoint has changed.
    ///
    /// # Errors
    /// [`LawLate`] where that response is not there.
    pub fn apply_response(&mut self, now: Micros, params: &Params) -> Result<bool, LawLate> {
        let Some((number, response)) = self.client.take_due(now) else { return Ok(false) };
        if self.request.take_if(|request| *request == number).is_none() {
            return Ok(false);
        }
        let LawResponse { setpoint, tensions, .. } = response.ok_or(LawLate)?;
        self.set_setpoint(now, setpoint, params);
        self.tensions = tensions;
        Ok(true)
    }
}

/// Time that a drive along a path stands still without a position before it is given up, µs.
/// People walk through a camera's view.
const PATIENCE_US: u64 = 2_000_000;

/// Returns the aim of a law whose rates take effect at `time`: of a drive that follows, or of one
/// to `target`.
fn aim(reference: Option<&ReferenceTracker>, target: Point, time: Micros, params: &Params) -> Aim {
    reference.map_or(Aim::at(target), |reference| reference.aim(time, params))
}

impl<L: Law> Servo<L> {
    /// Follows a path from `start` on, where the reference begins at rest.
    pub fn follow(&mut self, now: Micros, start: Point, reference: &Reference) {
        self.reference = Some(ReferenceTracker::new(now, start.micrometres(), reference));
    }

    /// Takes over the next part of the path, where it is newer than the last one. Returns whether
    /// it is; `None` while the drive follows no path.
    pub fn follow_on(&mut self, now: Micros, reference: &Reference) -> Option<bool> {
        self.reference.as_mut().map(|tracker| tracker.update(now, reference))
    }

    /// Ends the following where the path has ended. Returns the path's end; `None` where the drive
    /// follows none.
    pub(crate) fn end_following(&mut self) -> Option<Point> {
        self.reference.take().map(|reference| reference.last())
    }

    /// Returns when the reference needs its next step; `None` while the drive follows none.
    pub(crate) fn next_reference_step(&self, params: &Params) -> Option<Micros> {
        self.reference
            .as_ref()
            .map(|reference| reference.next_step(mean_lag_us(params.config.mean.0)))
    }

    /// Makes a part of the next state of the reference, where it is due at `now`. Call in every
    /// tick, before [`make_request`](Self::make_request). Returns the position of the reference at
    /// `now`; `None` while the drive follows none.
    pub fn advance_reference(
        &mut self,
        now: Micros,
        ReferenceTick { is_busy, can_move }: ReferenceTick,
        params: &Params,
    ) -> Option<Point> {
        let is_due = self.next_reference_step(params)? <= now;
        let is_seen = now.since(self.last_seen()) <= coasting_us(params.config.deadlines.position);
        let filtered = self.tracker.filtered().filter(|_| is_seen && can_move);
        let reference = self.reference.as_mut()?;
        if is_due && (!is_busy || reference.is_late(now, mean_lag_us(params.config.mean.0))) {
            let deviation = filtered.map(|ball| magnitude(error(ball, reference.smoothed())));
            reference.step(now, deviation, params);
        }
        Some(Point(reference.position(now).map(Micrometres)))
    }

    /// Returns the state of the reference for telemetry; `None` while the drive follows none.
    pub fn reference_state(&self, now: Micros) -> Option<ReferenceState> {
        self.reference.as_ref().map(|reference| reference.state(now))
    }

    /// Returns the last error and the filtered one of a drive to `target`, µm. Where the drive
    /// follows a reference, the errors are from where that was at the captures.
    pub(crate) fn errors(&self, target: Point) -> (PerAxis<i32>, u32) {
        let (last, filtered) = match &self.reference {
            Some(reference) => {
                (Point(reference.position(self.last_seen()).map(Micrometres)), reference.smoothed())
            }
            None => (target, target),
        };
        (
            self.tracker.last().map_or([0; AXES], |ball| error(ball, last)),
            self.tracker.filtered().map_or(0, |ball| magnitude(error(ball, filtered))),
        )
    }

    /// Returns the longest time without a position before the drive is given up, µs: their
    /// deadline, and more along a path, which waits at standstill.
    pub(crate) fn patience_us(&self, params: &Params) -> u64 {
        let deadline = limit_us(params.config.deadlines.position);
        if self.reference.is_some() { deadline + PATIENCE_US } else { deadline }
    }
}
