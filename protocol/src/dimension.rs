//! Numbers of motors and of axes, and arrays with an entry for each.

/// Number of motors, each with a cable: A, B and C.
pub const MOTORS: usize = 3;

/// Number of axes of the rig frame: x, y and z.
pub const AXES: usize = 3;

// The laws solve a square system: the ball has as many cables as axes in which it moves.
const _: () = assert!(MOTORS == AXES);

/// An entry for each motor, in the order A, B, C.
pub type PerMotor<T> = [T; MOTORS];

/// An entry for each axis of the rig frame, in the order x, y, z.
pub type PerAxis<T> = [T; AXES];
