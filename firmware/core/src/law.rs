//! Control laws: from the ball's error to motor rates.
//!
//! A [`Law`] takes a [`Measurement`] and returns a [`Setpoint`]. [`LawSelection`] names the
//! configured law; docs/understand/method.md describes each with its equations.

mod adaptive;
mod axis_kalman;
mod fixed_point;
mod interval;
mod io;
mod overshoot;
mod rates;
mod selection;
mod sign;
mod signs;
mod solve;
mod taut;

pub use adaptive::Adaptive;
pub use interval::{Interval, V_FRACTION_BITS};
#[cfg(test)]
pub(crate) use interval::{LIMB_BITS, MAX_ERROR as INTERVAL_ERROR};
pub use io::{Law, Limits, MOTOR_SAMPLE_US, Measurement, Setpoint, variances};
pub use rates::MotorRates;
pub use selection::{DeferredLaw, DeferredLawKind, InlineLaw, LawSelection};
pub use sign::Sign;
pub use taut::Taut;
