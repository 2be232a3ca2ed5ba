//! Putting questions to a law that takes longer than a tick.
//!
//! One question is open at a time, until the tick at which its answer takes effect. The newest
//! picture that comes meanwhile waits, and is asked about then. An answer concerns the target that
//! it was asked for: after another target, a stop or a fault it is void, but the law has learnt
//! from the picture all the same.

use plumb_protocol::units::{Covariance, Micros, Point};

use super::{LawRequest, LawResponse};
use crate::clock::TICK_US;
use crate::law::{MOTOR_SAMPLE_US, Measurement, Setpoint, variances};
use crate::params::Params;
use crate::plan::Planner;

/// The ball in a picture.
#[derive(Debug, Clone, Copy)]
struct PendingMeasurement {
    /// When it was taken.
    captured: Micros,
    /// µm.
    ball: [i32; 3],
    /// How sure that is, where that was told.
    covariance: Option<Covariance>,
}

/// A question whose answer has not taken effect yet.
#[derive(Debug, Clone, Copy)]
struct OpenRequest {
    /// When it does.
    due: Micros,
    /// The answer, once it is there.
    setpoint: Option<Setpoint>,
}

/// The questions to a slow law.
#[derive(Debug, Clone, Default)]
pub struct LawClient {
    /// Of the last question.
    number: u32,
    open: Option<OpenRequest>,
    /// The newest one that nothing was asked about.
    pending: Option<PendingMeasurement>,
    /// See [`LawRequest::configuration`].
    configuration: u32,
    /// To be handed out.
    request: Option<LawRequest>,
}

impl LawClient {
    /// The ball was seen at `ball` (µm), with this covariance, in a picture taken at `captured`.
    pub fn on_position(
        &mut self,
        captured: Micros,
        ball: [i32; 3],
        covariance: Option<Covariance>,
    ) {
        self.pending = Some(PendingMeasurement { captured, ball, covariance });
    }

    /// Nothing is sought that what was seen could be asked about.
    pub fn discard_pending(&mut self) {
        self.pending = None;
    }

    /// The next question is to a law that knows nothing: the board was configured.
    pub fn reset(&mut self) {
        self.configuration = self.configuration.wrapping_add(1);
    }

    /// Whether there is something to [`make_request`](Self::make_request) about, now or when no question is open any
    /// more.
    #[inline]
    pub fn has_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// After the planning of the tick at `now`: makes a question of what was seen, where none is
    /// open, and hands it [out](Self::take_request); its number.
    pub fn make_request(
        &mut self,
        now: Micros,
        target: Point,
        planner: &Planner,
        params: &Params,
    ) -> Option<u32> {
        let kind = params.deferred_law().filter(|_| self.open.is_none())?;
        let pending = self.pending.take()?;
        // The motors' positions are those at the tick's end.
        let end = Micros(now.0 + u64::from(TICK_US));
        let age_us = end.since(pending.captured).min(u64::from(u32::MAX)) as u32;
        let age_us = age_us.saturating_add(params.delay_us());
        let place =
            |times: u32| planner.positions_ago(age_us.saturating_add(times * MOTOR_SAMPLE_US));
        let measurement = Measurement {
            ball: pending.ball,
            variances: variances(pending.covariance),
            motors: place(0),
            motors_before: [place(1), place(2)],
            motors_ahead: planner.reference_after(kind.ticks() - 1),
            target: target.micrometres(),
        };
        self.number = self.number.wrapping_add(1);
        self.open = Some(OpenRequest {
            due: Micros(now.0 + u64::from(kind.ticks() * TICK_US)),
            setpoint: None,
        });
        let (number, limits, configuration) = (self.number, params.limits(), self.configuration);
        self.request = Some(LawRequest { number, kind, limits, configuration, measurement });
        Some(number)
    }

    /// Ticks between that at `now` and the one in which an answer takes effect.
    pub(crate) fn ticks_to_due(&self, now: Micros) -> u32 {
        let left = self.open.map_or(u64::MAX, |open| open.due.since(now).saturating_sub(1));
        (left / u64::from(TICK_US)).min(u64::from(u32::MAX)) as u32
    }

    /// Hands the question out, once.
    #[inline]
    pub fn take_request(&mut self) -> Option<LawRequest> {
        self.request.take()
    }

    /// The answer has come; one that is too late is of no use any more.
    pub fn on_response(&mut self, response: &LawResponse) {
        if let Some(open) = &mut self.open
            && response.number == self.number
        {
            open.setpoint = Some(response.setpoint);
        }
    }

    /// The question whose answer takes effect at `now`, and the answer, if it is there.
    pub fn take_due(&mut self, now: Micros) -> Option<(u32, Option<Setpoint>)> {
        let open = self.open.take_if(|open| open.due <= now)?;
        Some((self.number, open.setpoint))
    }
}
