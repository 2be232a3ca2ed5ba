//! Baselines in `f64`: uncalibrated visual servoing, and inverse kinematics with an inaccurate
//! model.

mod broyden;
mod model;

pub(super) use broyden::Broyden;
pub(super) use model::Model;
