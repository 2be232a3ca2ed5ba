//! Names of the suites.

use std::fmt;
use std::str::FromStr;

use crate::UnknownName;

/// Name of a suite. Each differs from [`QuasiStatic`](Self::QuasiStatic) in the respect given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SuiteName {
    /// The default population, camera and physics.
    QuasiStatic,
    /// Rigs yawed by up to ±20°.
    Yaw,
    /// Motor plane tilted by up to 10°.
    Tilt,
    /// Motor plane tilted by up to 20°.
    Tilt20,
    /// Pulley radii that differ by up to ±30 %.
    Radii,
    /// Motor heights that differ by up to ±10 cm.
    Heights,
    /// Position noise of 6, 3, 3 mm.
    Noise,
    /// 5 % outliers of 50 mm.
    Outliers,
    /// Latency of 1 to 2 frames, assumed to be 1.5.
    Ages,
    /// Latency of 4 frames, assumed to be 1.5.
    Latency,
    /// Correlated depth noise and a threshold of 3 mm.
    Drift,
    /// Rigid cables that cannot push.
    Unilateral,
    /// A resonance of the ball at 4 Hz.
    Bounce4,
    /// A resonance of the ball at 3 Hz.
    Bounce3,
    /// A resonance of the ball at 2 Hz.
    Bounce2,
    /// Spring cables of 800 and 150 N/m in turn.
    Elastic,
    /// Spring cables of 800 N/m.
    Elastic800,
    /// Spring cables of 150 N/m.
    Elastic150,
    /// Spring cables of 800 N/m, of which the rig file says that they are stiff.
    Stiff,
    /// Spring cables of 800 N/m, and each further target is that of a new run on the same board.
    Warm800,
    /// The same with cables of 150 N/m.
    Warm150,
    /// Both stiffnesses in turn, and a motor is moved by 5 cm before the second run.
    WarmMoved,
    /// Both stiffnesses in turn, and other pulleys before the second run: 1.5 times as large, or as
    /// small.
    WarmPulleys,
    /// Start and target close to the edge of the reachable region.
    Edge,
    /// Start and target close below the motors.
    High,
    /// A threshold of 2 mm.
    Fine,
    /// Positions turned by 5° about the target.
    Frame5,
    /// Positions turned by 10° about the target.
    Frame10,
    /// Positions turned by 20° about the target.
    Frame20,
    /// The camera's pose from a printed board.
    CalibratedBoard,
    /// The camera's pose from the motors' pixels.
    CalibratedMotors,
    /// The camera's pose from places of the ball.
    CalibratedBall,
    /// The paper's rig and task with the default camera.
    PaperTask,
}

impl SuiteName {
    /// Every suite.
    pub const ALL: [Self; 33] = [
        Self::QuasiStatic,
        Self::Yaw,
        Self::Tilt,
        Self::Tilt20,
        Self::Radii,
        Self::Heights,
        Self::Noise,
        Self::Outliers,
        Self::Ages,
        Self::Latency,
        Self::Drift,
        Self::Unilateral,
        Self::Bounce4,
        Self::Bounce3,
        Self::Bounce2,
        Self::Elastic,
        Self::Elastic800,
        Self::Elastic150,
        Self::Stiff,
        Self::Warm800,
        Self::Warm150,
        Self::WarmMoved,
        Self::WarmPulleys,
        Self::Edge,
        Self::High,
        Self::Fine,
        Self::Frame5,
        Self::Frame10,
        Self::Frame20,
        Self::CalibratedBoard,
        Self::CalibratedMotors,
        Self::CalibratedBall,
        Self::PaperTask,
    ];

    /// Returns the name in options, reports and JSON.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::QuasiStatic => "quasi-static",
            Self::Yaw => "yaw",
            Self::Tilt => "tilt",
            Self::Tilt20 => "tilt20",
            Self::Radii => "radii",
            Self::Heights => "heights",
            Self::Noise => "noise",
            Self::Outliers => "outliers",
            Self::Ages => "ages",
            Self::Latency => "latency",
            Self::Drift => "drift",
            Self::Unilateral => "unilateral",
            Self::Bounce4 => "bounce4",
            Self::Bounce3 => "bounce3",
            Self::Bounce2 => "bounce2",
            Self::Elastic => "elastic",
            Self::Elastic800 => "elastic800",
            Self::Elastic150 => "elastic150",
            Self::Stiff => "stiff",
            Self::Warm800 => "warm800",
            Self::Warm150 => "warm150",
            Self::WarmMoved => "warm-moved",
            Self::WarmPulleys => "warm-pulleys",
            Self::Edge => "edge",
            Self::High => "high",
            Self::Fine => "fine",
            Self::Frame5 => "frame5",
            Self::Frame10 => "frame10",
            Self::Frame20 => "frame20",
            Self::CalibratedBoard => "calibrated-board",
            Self::CalibratedMotors => "calibrated-motors",
            Self::CalibratedBall => "calibrated-ball",
            Self::PaperTask => "paper-task",
        }
    }

    /// Returns a description for people.
    #[must_use]
    pub const fn about(self) -> &'static str {
        match self {
            Self::QuasiStatic => "the default population",
            Self::Yaw => "rigs yawed by up to ±20°",
            Self::Tilt => "motor plane tilted by up to 10°",
            Self::Tilt20 => "motor plane tilted by up to 20°",
            Self::Radii => "each pulley ±30 %",
            Self::Heights => "each motor ±10 cm",
            Self::Noise => "noise of 6, 3, 3 mm",
            Self::Outliers => "5 % outliers of 50 mm",
            Self::Ages => "latency of 1 to 2 frames, assumed to be 1.5",
            Self::Latency => "latency of 4 frames, assumed to be 1.5",
            Self::Drift => "depth noise AR(1) 0.9 of 2 mm, threshold 3 mm",
            Self::Unilateral => "rigid cables that cannot push",
            Self::Bounce4 => "a ball mode of 4 Hz, ζ = 0.1",
            Self::Bounce3 => "a ball mode of 3 Hz, ζ = 0.1",
            Self::Bounce2 => "a ball mode of 2 Hz, ζ = 0.05",
            Self::Elastic => "0.1-0.3 kg on 800 and 150 N/m in turn",
            Self::Elastic800 => "0.1-0.3 kg on 800 N/m",
            Self::Elastic150 => "0.1-0.3 kg on 150 N/m",
            Self::Stiff => "0.1-0.3 kg on 800 N/m, in the rig file too",
            Self::Warm800 => "0.1-0.3 kg on 800 N/m, a run for each target",
            Self::Warm150 => "0.1-0.3 kg on 150 N/m, a run for each target",
            Self::WarmMoved => "a run for each target, a motor moved by 5 cm after the first",
            Self::WarmPulleys => "a run for each target, pulleys x1.5 or /1.5 after the first",
            Self::Edge => "start and target with λ >= 0.005",
            Self::High => "5 to 20 cm below the motors",
            Self::Fine => "threshold 2 mm",
            Self::Frame5 => "positions turned by 5° about the target",
            Self::Frame10 => "positions turned by 10° about the target",
            Self::Frame20 => "positions turned by 20° about the target",
            Self::CalibratedBoard => "the camera's pose from a printed board",
            Self::CalibratedMotors => "the camera's pose from the motors' pixels",
            Self::CalibratedBall => "the camera's pose from six places of the ball",
            Self::PaperTask => "the paper's rig and task with the default camera",
        }
    }
}

impl fmt::Display for SuiteName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for SuiteName {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let known = || UnknownName::new(Self::ALL.map(Self::as_str));
        Self::ALL.into_iter().find(|name| name.as_str() == text).ok_or_else(known)
    }
}
