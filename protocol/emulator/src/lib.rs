//! A board and a rig that are not there.
pub mod rig;
