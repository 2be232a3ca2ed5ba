//! The cases of the suite.

use nalgebra::{Point3, Vector3};

/// Seconds of one camera's cover and of the time between two covers.
const COVER_S: f64 = 1.0;

/// Seconds of a post before one camera.
const POST_S: f64 = 3.0;

/// Movement of the ball about the middle of the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Path {
    /// At rest, at another place in every run.
    Rest,
    /// An eight of 0.1 x 0.2 m at this speed, metres a second.
    Eight(f64),
    /// An upright circle of 0.1 m radius, slanted towards the cameras, at this speed, metres a
    /// second.
    Circle(f64),
}

impl Path {
    /// Returns the place at `t` seconds, from the middle; a run has its own `phase`, radians.
    pub(super) fn at(self, t: f64, phase: f64) -> Vector3<f64> {
        match self {
            Self::Rest => {
                let (sin, cos) = phase.sin_cos();
                Vector3::new(0.1 * (3.0 * phase).sin(), 0.1 * cos, 0.08 * sin)
            }
            // The length of the eight is 6.1 times its half height.
            Self::Eight(speed) => {
                let angle = phase + t * speed / (0.97 * 0.1);
                let (sin, cos) = angle.sin_cos();
                Vector3::new(0.03 * cos, 0.1 * sin * cos, 0.1 * sin)
            }
            Self::Circle(speed) => {
                let (sin, cos) = (phase + t * speed / 0.1).sin_cos();
                let slant = 0.3_f64;
                Vector3::new(0.1 * sin * slant.sin(), 0.1 * cos, 0.1 * sin * slant.cos())
            }
        }
    }
}

/// How a case's circles come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Circles {
    /// Computed, with noise.
    Computed,
    /// Found by the detector in rendered pictures.
    Rendered,
    /// Likewise, with a post before a part of the ball.
    RenderedBehindPost,
}

/// A case.
#[derive(Debug, Clone, Copy)]
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) path: Path,
    pub(super) circles: Circles,
    /// Whether each camera in turn sees no ball for a second.
    pub(super) covers: bool,
    /// Later stamps of the second camera than of the first, seconds.
    pub(super) late: f64,
    /// Diameter of the ball over the one that the cameras are told.
    pub(super) size: f64,
}

impl Case {
    /// A case without faults, on computed circles.
    const fn new(name: &'static str, path: Path) -> Self {
        Self { name, path, circles: Circles::Computed, covers: false, late: 0.0, size: 1.0 }
    }

    /// Returns whether the cameras see the ball `t` seconds after the start of a run.
    pub(super) fn sees(&self, t: f64) -> [bool; 2] {
        let quarter = (t / COVER_S) as usize % 4;
        [!self.covers || quarter != 1, !self.covers || quarter != 3]
    }

    /// Returns where a post is before each camera `t` seconds after the start of a run: its middle
    /// beside the ball's, in diameters of the ball. It covers a sixth to a half of the ball, on
    /// either side, in each camera's pictures for 3 seconds in turn.
    pub(super) fn post(&self, t: f64) -> [Option<f64>; 2] {
        let turn = (t / POST_S) as usize % 4;
        let beside = 0.46 + 0.17 * (1.3 * t).sin();
        let beside = if turn < 2 { beside } else { -beside };
        let is_there = |side| self.circles == Circles::RenderedBehindPost && turn % 2 == side;
        [0, 1].map(|side| is_there(side).then_some(beside))
    }
}

/// All cases but that of a camera that is turned.
pub(super) const CASES: [Case; 10] = [
    Case::new("at rest", Path::Rest),
    Case::new("eight, 5 cm/s", Path::Eight(0.05)),
    Case::new("circle, 19 cm/s", Path::Circle(0.19)),
    Case { covers: true, ..Case::new("covered in turns", Path::Eight(0.05)) },
    Case { late: 0.01, ..Case::new("latencies 10 ms apart", Path::Circle(0.19)) },
    Case { size: 1.02, ..Case::new("ball 2 % larger", Path::Eight(0.05)) },
    Case { circles: Circles::Rendered, ..Case::new("rendered, at rest", Path::Rest) },
    Case {
        circles: Circles::Rendered,
        ..Case::new("rendered, circle, 13 cm/s", Path::Circle(0.13))
    },
    Case {
        circles: Circles::Rendered,
        covers: true,
        ..Case::new("rendered, covered in turns", Path::Eight(0.05))
    },
    Case {
        circles: Circles::RenderedBehindPost,
        ..Case::new("rendered, partly covered", Path::Eight(0.05))
    },
];

/// Middle of the workspace, rig frame, metres: it is in the room of the renderer.
pub(super) const MIDDLE: Point3<f64> = Point3::new(0.537, 0.286, 0.225);
