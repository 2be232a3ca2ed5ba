//! The rig as a plant.
