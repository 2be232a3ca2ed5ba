//! Where each kind of fault acts, how long, and which causes describe it truly.

use std::ops::Range;

use plumb_protocol::message::{DriverFault, Fault};

use super::{Kind, Place};
use crate::cause::{Cause, TRAVEL};

/// Time in which a fault acts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Span {
    /// From the start on: a fault of the wiring.
    Always,
    /// From a random instant on.
    Lasting,
    /// From a random instant on, for this long, ms.
    Passing(Range<u64>),
}

/// What is known about a kind of fault.
#[derive(Debug)]
pub struct Traits {
    /// The kind.
    pub kind: Kind,
    /// Name in tables.
    pub name: &'static str,
    /// Where it acts.
    pub place: Place,
    /// When it acts.
    pub span: Span,
    /// Causes that describe it truly; see also [`Fault::explains`](crate::plan::Fault::explains).
    pub causes: &'static [Cause],
}

use Cause::Board;
use Fault::{
    BallOutside, Driver, EmergencyStop, ErrorGrowing, HostSilent, NoProgress, NotFollowing,
    PositionLost, Watchdog,
};
use Place::{Camera, Host, Link, Power, Rig};
use Span::{Always, Lasting, Passing};

/// Causes of a link that loses, delays or damages frames.
const POOR_LINK: &[Cause] =
    &[Board(HostSilent), Board(PositionLost), Cause::NoTelemetry, Cause::Lagging, Cause::NoAnswer];
/// Causes of a link that delays frames: the laws overshoot, and frames of a host that has ended
/// arrive in the life of the next one.
const SLOW_LINK: &[Cause] = &[
    Board(HostSilent),
    Board(PositionLost),
    Board(ErrorGrowing),
    Cause::NoTelemetry,
    Cause::Lagging,
    Cause::NoAnswer,
    Cause::Reconfigured,
];
/// Causes of positions that do not come, or are refused for their age.
const NO_POSITION: &[Cause] = &[Board(PositionLost)];
/// Causes of positions that are wrong, or of a ball that does not go where it should.
const WRONG_WAY: &[Cause] = &[
    Board(BallOutside),
    Board(ErrorGrowing),
    Board(NotFollowing),
    Board(NoProgress),
    TRAVEL,
    Cause::Doubt,
];
/// Causes of a camera that repeats one picture: the positions end, or they are wrong while the
/// motors turn slowly.
const REPEATED: &[Cause] = &[
    Cause::RepeatedPicture,
    Board(PositionLost),
    Board(NotFollowing),
    Board(NoProgress),
    Board(ErrorGrowing),
];
/// Causes of a host that sends nothing.
const SILENT: &[Cause] = &[Board(HostSilent)];
/// Causes of a board that has started anew; or has not yet, and sends nothing.
const RESTARTED: &[Cause] = &[Cause::Restarted, Cause::SessionLost, Cause::NoTelemetry];
/// Causes of a board that has started anew after an error.
const CRASHED: &[Cause] =
    &[Cause::Restarted, Cause::SessionLost, Cause::NoTelemetry, Board(Watchdog)];
/// Causes of a program of another version that has greeted the board.
const GREETED: &[Cause] = &[Cause::OtherProgram, Cause::SessionLost];

/// Every kind, in the order of [`Kind`] and of the table.
pub static KINDS: [Traits; 38] = {
    use Kind::*;
    [
        of(BitFlips, "bit flips", Link, Passing(50..4000), POOR_LINK),
        of(LostFrames, "lost frames", Link, Passing(50..4000), POOR_LINK),
        of(DoubledFrames, "doubled frames", Link, Passing(50..4000), POOR_LINK),
        of(ReorderedFrames, "reordered frames", Link, Passing(50..4000), POOR_LINK),
        of(TornFrames, "torn frames", Link, Passing(50..4000), POOR_LINK),
        of(DelayedFrames, "delayed frames", Link, Passing(50..4000), SLOW_LINK),
        of(Babble, "babble", Link, Passing(50..4000), POOR_LINK),
        of(WrongVersion, "Hello of another version", Link, Passing(1..1000), GREETED),
        of(Unplugged, "cable unplugged", Link, Lasting, &[Cause::Unplugged]),
        of(ReconnectStorm, "reconnect storm", Link, Passing(2000..4000), SILENT),
        of(FrozenPicture, "same picture, new stamp", Camera, Lasting, REPEATED),
        of(LateFrames, "late pictures", Camera, Lasting, NO_POSITION),
        of(Jumps, "jumps", Camera, Passing(50..4000), WRONG_WAY),
        of(WrongBall, "another ball", Camera, Lasting, WRONG_WAY),
        of(NoDepth, "depth dropped", Camera, Passing(100..4000), NO_POSITION),
        of(TimeBackwards, "time backwards", Camera, Lasting, NO_POSITION),
        of(NoFrames, "no pictures", Camera, Passing(100..4000), NO_POSITION),
        of(CameraGone, "camera gone", Camera, Lasting, &[Cause::Camera]),
        of(BumpedCamera, "camera turned", Camera, Lasting, WRONG_WAY),
        of(ReversedMotor, "motor reversed", Rig, Always, WRONG_WAY),
        of(SwappedMotors, "motors swapped", Rig, Always, WRONG_WAY),
        of(WrongSigns, "wrong Σ: every motor at the next output", Rig, Always, WRONG_WAY),
        of(WrongDrum, "drum of 0.1 to 10 radii", Rig, Always, WRONG_WAY),
        of(SlippingPulley, "slipping pulley", Rig, Lasting, WRONG_WAY),
        of(StuckMotor, "stuck motor", Rig, Lasting, WRONG_WAY),
        of(LostSteps, "lost steps", Rig, Lasting, WRONG_WAY),
        of(CutCable, "cut cable", Rig, Lasting, WRONG_WAY),
        of(CaughtBall, "ball caught", Rig, Lasting, WRONG_WAY),
        of(LiftedBall, "ball lifted by hand", Rig, Passing(500..3000), WRONG_WAY),
        of(PushedBall, "ball pushed by hand", Rig, Passing(500..3000), WRONG_WAY),
        of(KilledHost, "host killed", Host, Passing(50..3000), SILENT),
        of(PausedHost, "host stopped and continued", Host, Passing(20..3000), SILENT),
        of(DiskFull, "disk full", Host, Lasting, &[Cause::Output]),
        of(Reset, "reset", Power, Passing(1..1500), RESTARTED),
        of(Crash, "restart after an error", Power, Passing(1..1500), CRASHED),
        of(
            DriverBus,
            "driver bus cut",
            Power,
            Passing(10..3000),
            &[Board(Driver(DriverFault::Hat))],
        ),
        of(DriverUart, "trouble of a TMC2209", Power, Passing(10..3000), &[]),
        of(Emergency, "emergency input", Power, Passing(1..2000), &[Board(EmergencyStop)]),
    ]
};

const fn of(
    kind: Kind,
    name: &'static str,
    place: Place,
    span: Span,
    causes: &'static [Cause],
) -> Traits {
    Traits { kind, name, place, span, causes }
}

impl Kind {
    /// Returns what is known about the kind.
    pub fn traits(self) -> &'static Traits {
        &KINDS[self as usize]
    }
}

impl Kind {
    /// Returns the largest distance, m, by which the ball may move away from its target with this
    /// fault until the motors stand.
    pub fn bound_m(self) -> f64 {
        match self {
            // The camera cannot see what the ball does, or the ball falls or is moved by hand.
            Self::WrongBall | Self::BumpedCamera | Self::Jumps => 0.55,
            Self::WrongDrum | Self::CutCable | Self::LiftedBall | Self::PushedBall => 0.55,
            Self::ReversedMotor | Self::SwappedMotors | Self::WrongSigns => 0.30,
            _ => 0.15,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_order_of_the_kinds() {
        for (index, traits) in KINDS.iter().enumerate() {
            assert_eq!(traits.kind as usize, index, "{}", traits.name);
        }
    }
}
