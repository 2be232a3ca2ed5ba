//! The tests of the simulated rig.

mod broken_link;
mod frames;
mod link;
mod refused_target;
mod run_times;
