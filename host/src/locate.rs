//! From a detection to a position in the rig frame.
