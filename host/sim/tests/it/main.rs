//! The tests of the simulated rig.

mod broken_link;
mod colours;
mod frames;
mod link;
mod refused_target;
mod run_times;
