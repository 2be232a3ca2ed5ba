//! Deferred laws: laws that take longer than a tick run in a worker, and no tick waits for them.
//!
//! ```text
//! position -> Board::take_law_request -> LawRequest -> LawWorker::respond
//!          -> LawResponse -> Board::on_law_response, in effect DeferredLawKind::ticks later
//! ```
//!
//! A [`LawWorker`] owns the law with its state. On the chip it runs below everything else, on a
//! host it responds at once. The tick of the request alone fixes the tick in which the response
//! takes effect, so both behave alike, to the bit.

mod client;

use plumb_protocol::units::RelativeTension;

use crate::law::{DeferredLaw, DeferredLawKind, Law, Limits, Measurement, Setpoint};
pub use client::LawClient;

/// A request for one update of a deferred law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawRequest {
    /// Number of the request; wraps.
    pub number: u32,
    /// The configured law.
    pub kind: DeferredLawKind,
    /// Limits of the motors.
    pub limits: Limits,
    /// Number of the board's configuration; wraps. The worker replaces a law that was made for
    /// another one.
    pub generation: u32,
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
    pub tensions: Option<[RelativeTension; 3]>,
}

/// Worker that responds to the requests of one board, in their order: each updates the law's state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LawWorker {
    law: Option<Configured>,
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
        Self { law: None }
    }

    /// Updates the law with the request's measurement. The first request of a configuration makes
    /// the law anew, so a lost request leaves no law of an earlier configuration in place.
    #[inline(never)]
    pub fn respond(&mut self, request: &LawRequest) -> LawResponse {
        let LawRequest { number, kind, limits, generation, measurement } = request;
        self.law.take_if(|configured| configured.generation != *generation);
        let configured = self.law.get_or_insert_with(|| Configured {
            generation: *generation,
            law: DeferredLaw::new(*kind, *limits),
        });
        let setpoint = configured.law.update(measurement);
        LawResponse { number: *number, setpoint, tensions: configured.law.tensions() }
    }
}
