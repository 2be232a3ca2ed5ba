//! Control laws: from the ball's error to motor rates.
//!
//! A [`Law`] takes a [`Measurement`] and returns a [`Setpoint`]. [`LawSelection`] names the
//! configured law; docs/understand/method.md describes each with its equations.

mod adaptive;
mod interval;
mod io;
mod selection;
mod sign;
mod taut;

pub use adaptive::Adaptive;
pub use interval::{Interval, V_FRACTION_BITS};

#[cfg(test)]
pub(crate) use interval::{LIMB_BITS, MAX_ERROR as INTERVAL_ERROR};
pub use io::{
    Aim, Law, MOTOR_SAMPLE_US, Measurement, MotorLimits, MotorRates, Setpoint, variances,
};
pub use selection::{
    DeferredLaw, DeferredLawKind, DeferredTicks, InlineLaw, LawSelection, LawTicks,
};
pub use sign::Sign;
pub use taut::{KnownRig, Taut};
