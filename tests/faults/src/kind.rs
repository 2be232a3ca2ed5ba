//! Kinds of faults.

mod traits;

use std::fmt;

pub use traits::{KINDS, Span, Traits};

/// Part of the system in which a fault acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Link between host and board.
    Link,
    /// Camera.
    Camera,
    /// Motors, cables and ball.
    Rig,
    /// Host program.
    Host,
    /// Supply of the board and the drivers, and the emergency input.
    Power,
}

/// Kind of a fault. A range in its description is that of [`Fault::strength`], 0 to 1.
///
/// [`Fault::strength`]: crate::plan::Fault::strength
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Frames have one flipped bit; 5 % to all of them.
    BitFlips,
    /// Frames are lost; 5 % to all of them.
    LostFrames,
    /// Frames arrive twice; 5 % to all of them.
    DoubledFrames,
    /// Frames take up to 50 ms longer, so that later ones overtake them; 5 % to all of them.
    ReorderedFrames,
    /// Frames end early, without the closing zero; 5 % to all of them.
    TornFrames,
    /// Frames take 10 ms to 600 ms longer.
    DelayedFrames,
    /// Random bytes between the frames, 1 to 20 in one of ten ticks.
    Babble,
    /// A program of another version sends its Hello every 100 ms.
    WrongVersion,
    /// The port of the host is gone.
    Unplugged,
    /// The host is killed and started anew 8 times, after 20 ms to 400 ms each.
    ReconnectStorm,
    /// The same picture with new time stamps.
    FrozenPicture,
    /// Pictures arrive 0.1 s to 2 s later, with true time stamps.
    LateFrames,
    /// The ball is seen elsewhere, 0.05 m to 0.5 m away; in 5 % to all pictures.
    Jumps,
    /// Another ball is seen, at rest in the workspace.
    WrongBall,
    /// The pictures have no depth at the ball.
    NoDepth,
    /// Time stamps are 0.05 s to 2 s too old.
    TimeBackwards,
    /// No picture comes, and no error.
    NoFrames,
    /// The camera reports that it is gone.
    CameraGone,
    /// The camera is turned by 30° to 180° about the vertical through the workspace's middle.
    BumpedCamera,
    /// A motor turns the wrong way.
    ReversedMotor,
    /// Two motors are swapped.
    SwappedMotors,
    /// Every motor is connected to the next one's output: the signs Σ are wrong.
    WrongSigns,
    /// A drum has 0.1 to 0.3 or 3 to 10 times the radius of the others.
    WrongDrum,
    /// A pulley slips: it turns by 0 % to 90 % of its motor.
    SlippingPulley,
    /// A motor stands, and its steps are counted.
    StuckMotor,
    /// A motor loses steps for 20 ms at a time, 5 % to 60 % of the time.
    LostSteps,
    /// A cable tears.
    CutCable,
    /// The ball is held where it is.
    CaughtBall,
    /// A hand lifts the ball by 0.05 m to 0.3 m and lowers it again.
    LiftedBall,
    /// A hand pushes the ball to and fro by 0.05 m to 0.2 m.
    PushedBall,
    /// The host is killed, and started anew later.
    KilledHost,
    /// The host is stopped, and continued later.
    PausedHost,
    /// The disk is full: an output of the run fails.
    DiskFull,
    /// The board loses its power, or its reset pin is touched, and it starts anew.
    Reset,
    /// The board restarts after an error of its program.
    Crash,
    /// The motor drivers do not answer.
    DriverBus,
    /// A motor's TMC2209 on a UART has one of its troubles, two of which are only warnings.
    DriverUart,
    /// The emergency input opens; its contact bounces when it opens and when it closes.
    Emergency,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Link => "link",
            Self::Camera => "camera",
            Self::Rig => "rig",
            Self::Host => "host",
            Self::Power => "power",
        })
    }
}
