//! Faults that commissioning names.

use std::fmt;

use serde::Serialize;

/// Output of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Output {
    /// Output A.
    A,
    /// Output B.
    B,
    /// Output C.
    C,
}

impl Output {
    /// The outputs in their order.
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::C];
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// Fault of a rig. Its text says what is wrong and what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// The motors of two outputs are exchanged.
    Swapped(Output, Output),
    /// All three motors are on other outputs: those on outputs A, B, C.
    Rotated([Output; 3]),
    /// The motor of an output turns the wrong way.
    Reversed(Output),
    /// The ball does not follow the motor of an output at all.
    Still(Output),
    /// The cable of an output's motor is slack.
    Slack(Output),
    /// The cable of an output's motor slips, or the motor loses steps.
    Slips(Output),
    /// The camera's pose is turned about the vertical.
    Turned {
        /// Angle counter-clockwise as seen from above, degrees.
        degrees: u16,
    },
    /// Left and right are exchanged: by a mirrored picture, or by a rig frame whose axes are
    /// left-handed.
    Mirrored,
    /// Up and down are exchanged in the camera's pose.
    UpsideDown,
    /// A step winds more or less cable than `size.cable_per_step` says.
    CablePerStep {
        /// Cable of a step over that of the rig file, percent.
        percent: u32,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Swapped(first, second) => write!(
                f,
                "motors {first} and {second} are swapped: output {first} turns motor {second}, and \
                 output {second} motor {first}. Let the ball down, switch the power off and \
                 exchange their plugs."
            ),
            Self::Rotated([a, b, c]) => write!(
                f,
                "the motors are on other outputs: output A turns motor {a}, output B motor {b}, \
                 output C motor {c}. Let the ball down, switch the power off and exchange the \
                 plugs."
            ),
            Self::Reversed(output) => write!(
                f,
                "the motor on output {output} turns the wrong way. Reverse it in the rig file \
                 (`motors.reversed`), or turn the plug of one of its coils."
            ),
            Self::Still(output) => write!(
                f,
                "the ball does not follow output {output}. `plumb jog` this output and look at the \
                 motor: if it stands, check its plug, its driver and the driver's current; if it \
                 turns, its cable is slack or its drum is loose."
            ),
            Self::Slack(output) => write!(
                f,
                "the cable of output {output} is slack: the ball moves in one direction of the \
                 motor only. Wind the cable in with `plumb jog` until it is taut."
            ),
            Self::Slips(output) => write!(
                f,
                "the ball does not come back when output {output} turns back: its cable slips on \
                 the drum, its drum on the shaft, or the motor loses steps. Tighten the drum, wind \
                 the cable anew, or raise the driver's current."
            ),
            Self::Turned { degrees } => write!(
                f,
                "the camera's pose is turned about the vertical by about {degrees} degrees. Run \
                 `plumb calibrate`."
            ),
            Self::Mirrored => f.write_str(
                "left and right are exchanged in the measured positions. Switch the camera's \
                 mirror mode off; if it is off, run `plumb calibrate` with right-handed axes.",
            ),
            Self::UpsideDown => f.write_str(
                "up and down are exchanged in the camera's pose: the camera hangs upside down, or \
                 its quaternion is wrong. Run `plumb calibrate`.",
            ),
            Self::CablePerStep { percent } => write!(
                f,
                "a step winds {:.2} times the cable of `size.cable_per_step`. Compare the \
                 microsteps that the drivers' jumpers set with `motors.microsteps`, the motors' \
                 steps a turn (200 or 400) and the circumference of the drums with that key.",
                f64::from(*percent) / 100.0
            ),
        }
    }
}
