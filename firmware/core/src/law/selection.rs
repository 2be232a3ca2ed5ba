//! The configured law, and where it runs: inline, in the tick of the position, or deferred, below
//! the ticks.

use plumb_protocol::config;
use plumb_protocol::dimension::PerMotor;
use plumb_protocol::prior::Prior;
use plumb_protocol::units::RelativeTension;

use super::adaptive::Adaptive;
use super::interval::Interval;
use super::io::{Law, Measurement, MotorLimits, Setpoint};
use super::sign::Sign;
use super::taut::{KnownRig, Taut};
use crate::timing::TICK_US;

/// A configured law before its first measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LawSelection {
    /// A law that answers in the tick of the position.
    Inline(InlineLaw),
    /// A law that the law worker runs.
    Deferred(DeferredLawKind),
}

impl LawSelection {
    /// Returns the law of a validated configuration with as many motors.
    pub(crate) fn new(law: &config::Law, motor_count: u8) -> Self {
        match law {
            config::Law::Interval(law) => Self::Inline(InlineLaw::Interval(Interval::new(law))),
            config::Law::Sign(law) => Self::Inline(InlineLaw::Sign(Sign::new(law, motor_count))),
            config::Law::Adaptive(_) => Self::Deferred(DeferredLawKind::Adaptive),
            config::Law::Taut(_) => Self::Deferred(DeferredLawKind::Taut),
        }
    }
}

/// A law that answers within the tick in which a position comes, with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InlineLaw {
    /// See [`Interval`].
    Interval(Interval),
    /// See [`Sign`].
    Sign(Sign),
}

impl Law for InlineLaw {
    fn uses_velocity(&self) -> bool {
        false
    }

    #[inline(never)]
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        match self {
            Self::Interval(law) => law.update(measurement),
            Self::Sign(law) => law.update(measurement),
        }
    }
}

/// The laws that take longer than a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeferredLawKind {
    /// See [`Adaptive`].
    Adaptive,
    /// See [`Taut`].
    Taut,
}

impl DeferredLawKind {
    /// Returns the kind of a configured law; `None` for an inline one.
    pub(crate) fn of(law: &config::Law) -> Option<Self> {
        match law {
            config::Law::Interval(_) | config::Law::Sign(_) => None,
            config::Law::Adaptive(_) => Some(Self::Adaptive),
            config::Law::Taut(_) => Some(Self::Taut),
        }
    }

    /// Returns the ticks of this law.
    pub const fn ticks(self, ticks: &LawTicks) -> DeferredTicks {
        match self {
            Self::Adaptive => ticks.adaptive,
            Self::Taut => ticks.taut,
        }
    }
}

/// Ticks from the request to a deferred law to the one in which its response takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeferredTicks {
    /// For a target that stands.
    pub standing: u16,
    /// For a target that moves: the laws also compute what that asks of the motors. At least
    /// `standing`.
    pub following: u16,
}

impl DeferredTicks {
    const fn ms(standing: u32, following: u32) -> Self {
        Self {
            standing: (standing * 1000 / TICK_US) as u16,
            following: (following * 1000 / TICK_US) as u16,
        }
    }
}

/// [`DeferredTicks`] of each deferred law, on one chip: the longest time that the law takes there
/// with the ticks and links that interrupt it (`make bench-chip`), and a third of that in reserve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawTicks {
    /// Of [`Adaptive`].
    pub adaptive: DeferredTicks,
    /// Of [`Taut`].
    pub taut: DeferredTicks,
}

impl LawTicks {
    /// Those of an RP2040. Boards that have them respond alike, to the bit.
    pub const RP2040: Self =
        Self { adaptive: DeferredTicks::ms(1, 2), taut: DeferredTicks::ms(16, 20) };
}

/// A law that takes longer than a tick, with its state.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "the chip has no heap, and there is one of it")]
pub enum DeferredLaw {
    /// See [`Adaptive`].
    Adaptive(Adaptive),
    /// See [`Taut`].
    Taut(Taut),
}

impl DeferredLaw {
    /// Creates the law before its first measurement, for motors of these limits. It begins with
    /// what its `prior` tells; [`Taut`] takes the rig that is `known` from an earlier run, which
    /// was measured by driving, and its prior where there is none.
    pub fn new(
        kind: DeferredLawKind,
        limits: MotorLimits,
        prior: Option<&Prior>,
        known: &mut Option<KnownRig>,
    ) -> Self {
        match kind {
            DeferredLawKind::Adaptive => {
                let jacobian = match prior {
                    Some(Prior::Jacobian(jacobian)) => Some(*jacobian),
                    _ => None,
                };
                Self::Adaptive(Adaptive::new(limits, jacobian))
            }
            DeferredLawKind::Taut => {
                let measured = || match prior {
                    Some(Prior::Rig(rig)) => Some(KnownRig::measured(rig)),
                    _ => None,
                };
                Self::Taut(Taut::new(limits, known.take().or_else(measured)))
            }
        }
    }

    /// Returns the rig for the next run; `None` where the law does not know it.
    pub fn known_rig(&self) -> Option<KnownRig> {
        match self {
            Self::Adaptive(_) => None,
            Self::Taut(law) => law.known_rig(),
        }
    }
}

impl Law for DeferredLaw {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        match self {
            Self::Adaptive(law) => law.update(measurement),
            Self::Taut(law) => law.update(measurement),
        }
    }

    fn tensions(&self) -> Option<PerMotor<RelativeTension>> {
        match self {
            Self::Adaptive(law) => law.tensions(),
            Self::Taut(law) => law.tensions(),
        }
    }
}
