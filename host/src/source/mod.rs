//! Sources of pictures that no camera takes: synthetic ones, and those of a simulated rig. The
//! cameras and recordings are in [`plumb_cameras::source`].

pub mod simulated;
pub mod synthetic;
