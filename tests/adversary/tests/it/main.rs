//! The searches for broken invariants, short.

mod board;
mod frames;
mod laws;
mod travel;
