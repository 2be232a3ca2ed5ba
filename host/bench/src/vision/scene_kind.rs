//! The kinds of rendered scenes.

/// A kind of rendered scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SceneKind {
    /// Name in the report.
    pub(super) name: &'static str,
    /// Background.
    pub(super) backdrop: Backdrop,
    /// Objects besides the rig.
    pub(super) addition: Addition,
    /// Whether the scene contains the rig's ball.
    pub(super) ball: bool,
    /// Exposure; 1 is normal.
    pub(super) light: f64,
    /// Standard deviation of the blur of drawn objects, pixels.
    pub(super) blur: f64,
    /// Range of the ball's radius, as multiples of the option's radius.
    pub(super) radii: RadiusRange,
    /// Whether about half of the ball lies outside the frame.
    pub(super) half_out: bool,
}

/// Background of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Backdrop {
    /// A grey room.
    GreyWall,
    /// A white room.
    WhiteWall,
    /// A grey room with a lamp and a window.
    LampAndWindow,
    /// A grey room with a red sheet of paper.
    RedPaper,
    /// A grey room with red objects.
    RedThings,
    /// The furnished room.
    Furnished,
    /// Recorded frames.
    Recorded,
}

/// Objects in a scene besides the rig. Colours are sRGB in the order red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Addition {
    /// No object.
    Nothing,
    /// A ball of each colour beside the rig's.
    Balls(&'static [[u8; 3]]),
    /// A cable across the ball.
    Cable([u8; 3]),
    /// A post that occludes a part of the ball.
    Post,
    /// Red balls of twice and half the diameter.
    RedBalls,
}

const WHITE: [u8; 3] = [242, 241, 238];
const SKIN: [u8; 3] = [228, 178, 148];
const ORANGE: [u8; 3] = [240, 132, 30];
pub(super) const RED: [u8; 3] = [196, 32, 34];

/// Range of a ball's radius, as multiples of the option's radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RadiusRange {
    pub(super) min: f64,
    pub(super) max: f64,
}

const fn radii(min: f64, max: f64) -> RadiusRange {
    RadiusRange { min, max }
}

const fn kind(name: &'static str, backdrop: Backdrop, addition: Addition) -> SceneKind {
    let (light, blur, radii) = (1.0, 0.6, radii(0.85, 1.15));
    SceneKind { name, backdrop, addition, ball: true, light, blur, radii, half_out: false }
}

const fn empty(name: &'static str, backdrop: Backdrop, addition: Addition) -> SceneKind {
    SceneKind { ball: false, ..kind(name, backdrop, addition) }
}

/// Every kind of scene in the order of the report.
pub(super) const KINDS: [SceneKind; 29] = [
    kind("clean", Backdrop::GreyWall, Addition::Nothing),
    SceneKind { light: 0.25, ..kind("dark", Backdrop::GreyWall, Addition::Nothing) },
    SceneKind { light: 2.5, ..kind("overexposed", Backdrop::GreyWall, Addition::Nothing) },
    kind("white ball beside it", Backdrop::GreyWall, Addition::Balls(&[WHITE])),
    kind("lamp and window", Backdrop::LampAndWindow, Addition::Nothing),
    kind("white wall behind", Backdrop::WhiteWall, Addition::Nothing),
    kind("skin ball", Backdrop::GreyWall, Addition::Balls(&[SKIN])),
    kind("orange ball", Backdrop::GreyWall, Addition::Balls(&[ORANGE])),
    kind("red paper", Backdrop::RedPaper, Addition::Nothing),
    kind("dark cable across", Backdrop::GreyWall, Addition::Cable([34, 33, 32])),
    kind("white cable across", Backdrop::GreyWall, Addition::Cable(WHITE)),
    kind("furnished room", Backdrop::Furnished, Addition::Nothing),
    kind("red things behind", Backdrop::RedThings, Addition::Nothing),
    kind("other red balls", Backdrop::GreyWall, Addition::RedBalls),
    kind("partly behind a post", Backdrop::Furnished, Addition::Post),
    SceneKind {
        half_out: true,
        ..kind("half out of the picture", Backdrop::GreyWall, Addition::Nothing)
    },
    SceneKind { blur: 3.0, ..kind("out of focus", Backdrop::GreyWall, Addition::Nothing) },
    SceneKind { radii: radii(1.6, 2.3), ..kind("near", Backdrop::GreyWall, Addition::Nothing) },
    SceneKind {
        radii: radii(2.4, 3.0),
        ..kind("too near for depth", Backdrop::GreyWall, Addition::Nothing)
    },
    SceneKind { radii: radii(0.42, 0.65), ..kind("far", Backdrop::GreyWall, Addition::Nothing) },
    kind("real picture", Backdrop::Recorded, Addition::Nothing),
    empty("no ball", Backdrop::GreyWall, Addition::Nothing),
    empty("no ball: lamp and window", Backdrop::LampAndWindow, Addition::Nothing),
    empty("no ball: other balls", Backdrop::GreyWall, Addition::Balls(&[WHITE, SKIN, ORANGE])),
    empty("no ball: other red balls", Backdrop::GreyWall, Addition::RedBalls),
    empty("no ball: red paper", Backdrop::RedPaper, Addition::Nothing),
    empty("no ball: red things", Backdrop::RedThings, Addition::Nothing),
    empty("no ball: furnished room", Backdrop::Furnished, Addition::Nothing),
    empty("no ball: real picture", Backdrop::Recorded, Addition::Nothing),
];
