//! Deferred laws: laws that take longer than a tick run in a worker, and no tick waits for them.
//!
//! ```text
//! position -> Board::take_law_request -> LawRequest -> LawWorker::respond
//!          -> LawResponse -> Board::on_law_response, in effect DeferredTicks later
//! ```
//!
//! A [`LawWorker`] owns the law with its state. On the chip it runs below everything else, on a
//! host it responds at once. The tick of the request alone fixes the tick in which the response
//! takes effect, so both behave alike, to the bit.
//!
//! The [`LawClient`] is the board's side. One request is open at a time, until the tick in which
//! its response takes effect. Of the positions that come meanwhile the newest waits, and becomes
//! the next request. A response belongs to the target of its request: after another target, a stop
//! or a fault it has no effect, but the law's state has taken in the position.

use plumb_protocol::dimension::{PerAxis, PerMotor};
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{Covariance, Micros, RelativeTension};

use crate::law::{
    Aim, DeferredLaw, DeferredLawKind, KnownRig, Law, MOTOR_SAMPLE_US, Measurement, MotorLimits,
    Setpoint, variances,
};
use crate::params::Params;
use crate::plan::Planner;
use crate::timing::TICK_US;

/// A request for one update of a deferred law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawRequest {
    /// Number of the request; wraps.
    pub number: u32,
    /// The configured law.
    pub kind: DeferredLawKind,
    /// Limits of the motors.
    pub limits: MotorLimits,
    /// Number of the board's configuration; wraps. The worker replaces a law that was made for
    /// another one.
    pub generation: u32,
    /// What a host knows of the rig.
    pub prior: Option<Prior>,
    /// Input of the law.
    pub measurement: Measurement,
}

/// Response to a [`LawRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawResponse {
    /// Number of the request.
    pub number: u32,
    /// Output of the law, not limited yet.
    pub setpoint: Setpoint,
    /// See [`Law::tensions`].
    pub tensions: Option<PerMotor<RelativeTension>>,
}

/// Worker that responds to the requests of one board, in their order: each updates the law's state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LawWorker {
    law: Option<Configured>,
    /// Rig that is known from an earlier configuration, until a law takes it.
    known: Option<KnownRig>,
}

/// A law, and the configuration that it was made for.
#[derive(Debug, Clone, PartialEq)]
struct Configured {
    /// See [`LawRequest::generation`].
    generation: u32,
    law: DeferredLaw,
}

impl LawWorker {
    /// Creates a worker without a law.
    pub const fn new() -> Self {
        Self { law: None, known: None }
    }

    /// Takes in the rig that is `known`, with which the next law begins.
    pub fn know(&mut self, known: Option<KnownRig>) {
        self.known = known;
    }

    /// Returns what is known of the rig for the next configuration.
    pub fn known_rig(&self) -> Option<KnownRig> {
        self.law
            .as_ref()
            .and_then(|configured| configured.law.known_rig())
            .or_else(|| self.known.clone())
    }

    /// Updates the law with the request's measurement. The first request of a configuration makes
    /// the law anew, so a lost request leaves no law of an earlier configuration in place. The new
    /// law begins with the rig that the one before has learnt.
    #[inline(never)]
    pub fn respond(&mut self, request: &LawRequest) -> LawResponse {
        let LawRequest { number, kind, limits, generation, prior, measurement } = request;
        if self.law.as_ref().is_some_and(|configured| configured.generation != *generation) {
            self.known = self.known_rig();
            self.law = None;
        }
        let configured = self.law.get_or_insert_with(|| Configured {
            generation: *generation,
            law: DeferredLaw::new(*kind, *limits, prior.as_ref(), &mut self.known),
        });
        let setpoint = configured.law.update(measurement);
        LawResponse { number: *number, setpoint, tensions: configured.law.tensions() }
    }
}

/// A position that waits to become a request.
#[derive(Debug, Clone, Copy)]
struct PendingMeasurement {
    /// When the frame was captured.
    captured: Micros,
    /// Position of the ball, µm.
    ball: PerAxis<i32>,
    /// Covariance of the position; `None` if the host did not send one.
    covariance: Option<Covariance>,
}

/// A request whose response has not taken effect yet.
#[derive(Debug, Clone, Copy)]
struct OpenRequest {
    /// When the response takes effect.
    due: Micros,
    /// The response, once it is there.
    response: Option<LawResponse>,
}

/// Client of a [`LawWorker`].
#[derive(Debug, Clone, Default)]
pub struct LawClient {
    /// Number of the last request.
    number: u32,
    open: Option<OpenRequest>,
    /// Newest position without a request.
    pending: Option<PendingMeasurement>,
    /// See [`LawRequest::generation`].
    generation: u32,
    /// See [`LawRequest::prior`].
    prior: Option<Prior>,
    /// Request that was made and not taken yet.
    request: Option<LawRequest>,
}

impl LawClient {
    /// Takes in the position `ball` (µm) of a frame that was captured at `captured`.
    pub fn on_position(
        &mut self,
        captured: Micros,
        ball: PerAxis<i32>,
        covariance: Option<Covariance>,
    ) {
        self.pending = Some(PendingMeasurement { captured, ball, covariance });
    }

    /// Discards the position that waits.
    pub fn discard_pending(&mut self) {
        self.pending = None;
    }

    /// Begins with another configuration: the law is made anew with the next request, and the
    /// position that waits is discarded.
    pub fn reset(&mut self) {
        self.know(None);
    }

    /// Begins anew with this `prior`, as [`reset`](Self::reset).
    pub fn know(&mut self, prior: Option<Prior>) {
        self.prior = prior;
        self.generation = self.generation.wrapping_add(1);
        self.discard_pending();
    }

    /// Checks whether a position waits to become a request.
    #[inline]
    pub fn has_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Makes a request from the position that waits, where no request is open, and returns its
    /// number. The response takes effect `ticks` later, and `aim` returns the target at that
    /// moment. Call after the planning of the tick at `now`. See
    /// [`take_request`](Self::take_request).
    pub fn make_request(
        &mut self,
        now: Micros,
        ticks: u32,
        aim: impl FnOnce(Micros) -> Aim,
        planner: &Planner,
        params: &Params,
    ) -> Option<u32> {
        let kind = params.deferred_law().filter(|_| self.open.is_none())?;
        let pending = self.pending.take()?;
        // The planner's positions are those at the end of the tick.
        let end = Micros(now.0 + u64::from(TICK_US));
        let age_us = end.since(pending.captured).min(u64::from(u32::MAX)) as u32;
        let age_us = age_us.saturating_add(params.delay_us());
        let motors =
            |times: u32| planner.positions_ago(age_us.saturating_add(times * MOTOR_SAMPLE_US));
        let due = Micros(now.0 + u64::from(ticks * TICK_US));
        let Aim { position, velocity } = aim(due);
        let measurement = Measurement {
            ball: pending.ball,
            variances: variances(pending.covariance),
            motors: motors(0),
            motors_before: [motors(1), motors(2)],
            motors_ahead: planner.reference_after(ticks - 1),
            target: position,
            velocity,
        };
        self.number = self.number.wrapping_add(1);
        self.open = Some(OpenRequest { due, response: None });
        let (number, limits, generation) = (self.number, params.limits(), self.generation);
        let prior = self.prior;
        self.request = Some(LawRequest { number, kind, limits, generation, prior, measurement });
        Some(number)
    }

    /// Returns the ticks between that at `now` and the one in which a response takes effect.
    pub(crate) fn ticks_to_due(&self, now: Micros) -> u32 {
        let left = self.open.map_or(u64::MAX, |open| open.due.since(now).saturating_sub(1));
        (left / u64::from(TICK_US)).min(u64::from(u32::MAX)) as u32
    }

    /// Returns the request that was made, once.
    #[inline]
    pub fn take_request(&mut self) -> Option<LawRequest> {
        self.request.take()
    }

    /// Takes in a response. One that comes too late is ignored.
    pub fn on_response(&mut self, response: &LawResponse) {
        if let Some(open) = &mut self.open
            && response.number == self.number
        {
            open.response = Some(*response);
        }
    }

    /// Returns the number of the request whose response takes effect at `now`, with the response
    /// where it is there. The request is then no longer open.
    pub fn take_due(&mut self, now: Micros) -> Option<(u32, Option<LawResponse>)> {
        let open = self.open.take_if(|open| open.due <= now)?;
        Some((self.number, open.response))
    }
}
