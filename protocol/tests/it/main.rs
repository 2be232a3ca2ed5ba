//! The tests of the frames and of the values in them.

mod frames;
mod values;
