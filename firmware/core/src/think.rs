//! Laws that take longer than a tick, and how they are asked without a tick waiting for them.
//!
//! ```text
//! position -> Board::question -> Question -> Thinker::answer -> Answer -> Board::answered
//!                 at the tick of the position                    in effect Kind::ticks later
//! ```
//!
//! A [`Thinker`] owns the law with what it has learnt, and may take its time: on the chip below
//! everything else, on a host at once. When an answer takes effect is fixed by the question's tick,
//! so that both do the same, to the bit.

mod asking;

use crate::law::{Adaptive, Demand, Law, Limits, Picture, Taut};
use crate::plan::TICK_US;
pub use asking::Asking;

/// The laws that take longer than a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// See [`Adaptive`].
    Adaptive,
    /// See [`Taut`].
    Taut,
}

impl Kind {
    /// Ticks from a question's to the one in which its answer takes effect. What the law takes of
    /// the chip at most with the ticks and links that go before it (`make bench-chip`), and a third
    /// of that in reserve.
    pub const fn ticks(self) -> u32 {
        match self {
            Self::Adaptive => 1_000 / TICK_US,
            Self::Taut => 16_000 / TICK_US,
        }
    }
}

/// What a law is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Question {
    /// Counts the questions, wrapping.
    pub number: u32,
    /// Which law.
    pub kind: Kind,
    /// The motors' limits.
    pub limits: Limits,
    /// Counts the board's configurations, wrapping. A law made for another one is replaced.
    pub configuration: u32,
    /// What is seen.
    pub picture: Picture,
}

/// What a law wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// The question's.
    pub number: u32,
    /// The law's demand, not limited yet.
    pub demand: Demand,
}

/// A law that takes longer than a tick, with its state.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "the chip has no heap, and there is one of it")]
pub enum Slow {
    /// See [`Adaptive`].
    Adaptive(Adaptive),
    /// See [`Taut`].
    Taut(Taut),
}

impl Slow {
    /// Before its first picture, for motors of these limits.
    pub fn new(kind: Kind, limits: Limits) -> Self {
        match kind {
            Kind::Adaptive => Self::Adaptive(Adaptive::new(limits)),
            Kind::Taut => Self::Taut(Taut::new(limits)),
        }
    }
}

impl Law for Slow {
    fn update(&mut self, picture: &Picture) -> Demand {
        match self {
            Self::Adaptive(law) => law.update(picture),
            Self::Taut(law) => law.update(picture),
        }
    }
}

/// Answers questions. All those of one board, in their order: what has been asked is what the law
/// has learnt.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Thinker {
    law: Option<Configured>,
}

/// A law, and the configuration that it was made for.
#[derive(Debug, Clone, PartialEq)]
struct Configured {
    /// See [`Question::configuration`].
    configuration: u32,
    law: Slow,
}

impl Thinker {
    /// One that has learnt nothing.
    pub const fn new() -> Self {
        Self { law: None }
    }

    /// Lets the law think. Makes it anew for the first question of a configuration, so that a lost
    /// question leaves no law of an earlier configuration in place.
    #[inline(never)]
    pub fn answer(&mut self, question: &Question) -> Answer {
        let Question { number, kind, limits, configuration, picture } = question;
        self.law.take_if(|kept| kept.configuration != *configuration);
        let kept = self.law.get_or_insert_with(|| Configured {
            configuration: *configuration,
            law: Slow::new(*kind, *limits),
        });
        Answer { number: *number, demand: kept.law.update(picture) }
    }
}
