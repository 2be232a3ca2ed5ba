//! From wanted motor rates to pulses: ramps within the limits, exact step counts, no motor past its
//! travel.
//!
//! Time goes in ticks of [`TICK_US`](crate::timing::TICK_US). In a tick each motor turns at a
//! constant rate. Between ticks the rates move towards the wanted ones with one common factor, so
//! that the path in motor space bends as little as it can. Divisions happen when the wanted rates
//! change ([`Planner::set_rates`]); a tick only adds.

#[cfg(test)]
mod arithmetic;
mod history;
mod jog;
mod moving_average;
mod planner;
mod pulses;
mod ramp;
mod step_axis;
mod travel_limit;

pub use jog::Jogging;
pub(crate) use moving_average::mean_lag_us;
pub use planner::{Planner, RunOut};
pub use pulses::{Pulses, StepPlan};
