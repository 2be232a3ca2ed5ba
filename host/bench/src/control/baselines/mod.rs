//! What others would use, in `f64`: uncalibrated servoing, and inverse kinematics with a model that
//! is not quite right.

mod broyden;
mod model;

pub(super) use broyden::Broyden;
pub(super) use model::Model;
