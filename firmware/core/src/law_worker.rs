//! Laws that take longer than a tick, and how they are asked without a tick waiting for them.
//!
//! ```text
//! position -> Board::take_law_request -> LawRequest -> LawWorker::respond -> LawResponse -> Board::on_law_response
//!              in the tick of the position                 in effect DeferredLawKind::ticks later
//! ```
//!
//! A [`LawWorker`] owns the law with what it has learnt, and may take its time: on the chip below
//! everything else, on a host at once. When an answer takes effect is fixed by the question's tick,
//! so that both do the same, to the bit.

mod client;

use crate::law::{DeferredLaw, DeferredLawKind, Law, Limits, Measurement, Setpoint};
pub use client::LawClient;

/// What a law is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawRequest {
    /// Counts the questions, wrapping.
    pub number: u32,
    /// Which law.
    pub kind: DeferredLawKind,
    /// The motors' limits.
    pub limits: Limits,
    /// Counts the board's configurations, wrapping. A law made for another one is replaced.
    pub configuration: u32,
    /// What is seen.
    pub measurement: Measurement,
}

/// What a law wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawResponse {
    /// The question's.
    pub number: u32,
    /// The law's setpoint, not limited yet.
    pub setpoint: Setpoint,
}

/// Answers questions. All those of one board, in their order: what has been asked is what the law
/// has learnt.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LawWorker {
    law: Option<Configured>,
}

/// A law, and the configuration that it was made for.
#[derive(Debug, Clone, PartialEq)]
struct Configured {
    /// See [`LawRequest::configuration`].
    configuration: u32,
    law: DeferredLaw,
}

impl LawWorker {
    /// One that has learnt nothing.
    pub const fn new() -> Self {
        Self { law: None }
    }

    /// Lets the law think. Makes it anew for the first question of a configuration, so that a lost
    /// question leaves no law of an earlier configuration in place.
    #[inline(never)]
    pub fn respond(&mut self, request: &LawRequest) -> LawResponse {
        let LawRequest { number, kind, limits, configuration, measurement } = request;
        self.law.take_if(|kept| kept.configuration != *configuration);
        let kept = self.law.get_or_insert_with(|| Configured {
            configuration: *configuration,
            law: DeferredLaw::new(*kind, *limits),
        });
        LawResponse { number: *number, setpoint: kept.law.update(measurement) }
    }
}
