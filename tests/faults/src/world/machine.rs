//! Interface of a board in a world.

use nalgebra::Point3;
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;

/// A board with its rig and its inputs, and the invariants that are checked on it.
pub(super) trait Machine {
    /// Returns the clock, from the start of the world.
    fn now(&self) -> Micros;

    /// Passes `frames` to the board and runs it for a tick. Returns what the board sends.
    fn tick(&mut self, frames: &[Vec<u8>]) -> Vec<u8>;

    /// Returns the place of the ball, m.
    fn ball(&self) -> Point3<f64>;

    /// Returns the state of the board; of the chip, that of its newest message.
    fn state(&self) -> State;

    /// Returns whether no motor turns.
    fn is_at_rest(&self) -> bool;

    /// Returns the broken invariants so far.
    fn violations(&self) -> Vec<String>;
}
