//! The kinds of frames of the suite `rooms`.

use serde::{Serialize, Serializer};

/// A kind of frame.
#[derive(Debug, Clone, Copy)]
pub(in crate::vision) struct RoomKind {
    /// Name in the report.
    pub(in crate::vision) name: &'static str,
    /// Whether the frame contains the ball.
    pub(in crate::vision) ball: bool,
    pub(super) condition: Condition,
    pub(super) depth: DepthState,
}

/// Property of the room, the light or the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Condition {
    /// None in particular.
    Plain,
    /// Exposure of 0.06 to 0.3.
    Dim,
    /// Exposure of 1.5 to 3.
    Bright,
    /// Colour noise of 6 to 20 of 255.
    Noisy,
    /// Defocus of the whole picture.
    Blurred,
    /// A post or two thick cables across the ball.
    Covered,
    /// Gains of 0.5 to 1.6 of each colour.
    ColourCast,
    /// Light of a bulb or a candle.
    WarmLight,
    /// Reddish cloth around and behind the ball.
    Cloth,
    /// Reddish wood around and behind the ball.
    Wood,
    /// All surfaces painted in one red.
    Wall,
    /// A rendered room with reddish walls, floor, curtains and furniture.
    ReddishRoom,
    /// Four to eight red objects.
    RedThings,
    /// Balls of another size or colour; if the ball is there too, a red one of another size.
    OtherBalls,
    /// A ball of 5 to 10 pixels radius.
    Far,
    /// JPEG of quality 8 to 25.
    StrongJpeg,
    /// Motion during the exposure and the readout of a rolling shutter.
    RollingMotion,
    /// A flat disc of the ball's diameter in place of the ball, with a radius of 8 to 60 pixels.
    Disc {
        /// Angle between the line of sight and the normal of the disc, degrees.
        slant: u8,
        /// Whether the background is a wall of one colour.
        plain: bool,
    },
}

/// State of the depth image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DepthState {
    /// As the sensor gives it.
    Complete,
    /// About half of it is missing, in patches.
    Half,
    /// Shifted by 4 pixels against colour.
    Shifted,
    /// All of it is missing.
    Missing,
}

named! {
    /// Group of kinds with one target.
    FrameGroup:
    WithDepth "with depth" "frames with a ball, with depth";
    WithoutDepth "without depth" "frames with a whole ball, without depth";
    CoveredWithoutDepth "covered, without depth" "frames with a covered ball, without depth";
    Empty "no ball" "frames without a ball";
}

impl Serialize for FrameGroup {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl RoomKind {
    /// Returns the group that the kind counts in.
    pub(in crate::vision) fn group(&self) -> FrameGroup {
        match (self.ball, self.depth, self.condition) {
            (false, ..) => FrameGroup::Empty,
            (true, DepthState::Missing, Condition::Covered) => FrameGroup::CoveredWithoutDepth,
            (true, DepthState::Missing, _) => FrameGroup::WithoutDepth,
            (true, ..) => FrameGroup::WithDepth,
        }
    }
}

const fn ball(name: &'static str, condition: Condition, depth: DepthState) -> RoomKind {
    RoomKind { name, ball: true, condition, depth }
}

const fn disc(name: &'static str, slant: u8, plain: bool) -> RoomKind {
    ball(name, Condition::Disc { slant, plain }, DepthState::Missing)
}

const fn empty(name: &'static str, condition: Condition, depth: DepthState) -> RoomKind {
    RoomKind { name, ball: false, condition, depth }
}

/// Every kind in the order of the report.
pub(in crate::vision) const KINDS: [RoomKind; 50] = {
    use Condition as C;
    use DepthState as D;
    [
        ball("plain", C::Plain, D::Complete),
        ball("dim", C::Dim, D::Complete),
        ball("bright", C::Bright, D::Complete),
        ball("noisy", C::Noisy, D::Complete),
        ball("blurred", C::Blurred, D::Complete),
        ball("partly covered", C::Covered, D::Complete),
        ball("colour cast", C::ColourCast, D::Complete),
        ball("warm light", C::WarmLight, D::Complete),
        ball("reddish cloth", C::Cloth, D::Complete),
        ball("reddish wood", C::Wood, D::Complete),
        ball("reddish paint", C::Wall, D::Complete),
        ball("reddish room", C::ReddishRoom, D::Complete),
        ball("red things", C::RedThings, D::Complete),
        ball("a ball of another size", C::OtherBalls, D::Complete),
        ball("far and small", C::Far, D::Complete),
        ball("strong JPEG", C::StrongJpeg, D::Complete),
        ball("rolling motion blur", C::RollingMotion, D::Complete),
        ball("half the depth", C::Plain, D::Half),
        ball("half the depth, reddish", C::ReddishRoom, D::Half),
        ball("depth shifted by 4 px", C::Plain, D::Shifted),
        ball("no depth", C::Plain, D::Missing),
        ball("no depth: dim", C::Dim, D::Missing),
        ball("no depth: bright", C::Bright, D::Missing),
        ball("no depth: noisy", C::Noisy, D::Missing),
        ball("no depth: blurred", C::Blurred, D::Missing),
        ball("no depth: partly covered", C::Covered, D::Missing),
        ball("no depth: colour cast", C::ColourCast, D::Missing),
        ball("no depth: warm light", C::WarmLight, D::Missing),
        ball("no depth: reddish cloth", C::Cloth, D::Missing),
        ball("no depth: reddish wood", C::Wood, D::Missing),
        ball("no depth: reddish paint", C::Wall, D::Missing),
        ball("no depth: reddish room", C::ReddishRoom, D::Missing),
        ball("no depth: red things", C::RedThings, D::Missing),
        ball("no depth: far and small", C::Far, D::Missing),
        ball("no depth: strong JPEG", C::StrongJpeg, D::Missing),
        ball("no depth: rolling blur", C::RollingMotion, D::Missing),
        empty("no ball", C::Plain, D::Complete),
        empty("no ball: colour cast", C::ColourCast, D::Complete),
        empty("no ball: warm light", C::WarmLight, D::Complete),
        empty("no ball: reddish wood", C::Wood, D::Complete),
        empty("no ball: reddish room", C::ReddishRoom, D::Complete),
        empty("no ball: red things", C::RedThings, D::Complete),
        empty("no ball: other balls", C::OtherBalls, D::Complete),
        empty("no ball: half the depth", C::RedThings, D::Half),
        empty("no ball, no depth", C::Plain, D::Missing),
        empty("no ball, no depth: colour cast", C::ColourCast, D::Missing),
        empty("no ball, no depth: warm light", C::WarmLight, D::Missing),
        empty("no ball, no depth: reddish wood", C::Wood, D::Missing),
        empty("no ball, no depth: reddish room", C::ReddishRoom, D::Missing),
        empty("no ball, no depth: red things", C::RedThings, D::Missing),
    ]
};

/// Kinds of the suite `disc`, in the order of the report.
pub(in crate::vision) const DISC_KINDS: [RoomKind; 15] = {
    use Condition as C;
    use DepthState as D;
    [
        disc("plain wall, slant 0°", 0, true),
        disc("plain wall, slant 10°", 10, true),
        disc("plain wall, slant 20°", 20, true),
        disc("plain wall, slant 30°", 30, true),
        disc("plain wall, slant 40°", 40, true),
        disc("plain wall, slant 50°", 50, true),
        disc("room, slant 0°", 0, false),
        disc("room, slant 10°", 10, false),
        disc("room, slant 20°", 20, false),
        disc("room, slant 30°", 30, false),
        disc("room, slant 40°", 40, false),
        disc("room, slant 50°", 50, false),
        empty("no disc", C::Plain, D::Missing),
        empty("no disc: warm light", C::WarmLight, D::Missing),
        empty("no disc: things of its hue", C::RedThings, D::Missing),
    ]
};
