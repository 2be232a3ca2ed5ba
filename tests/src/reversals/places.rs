//! Places of a run: the start, and a target on either side of it.

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{Geometry, Population, Task};
use plumb_protocol::config::Workspace;
use plumb_protocol::units::Point;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rig of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RigKind {
    /// The paper's, on rigid cables.
    Paper,
    /// The paper's, on elastic cables.
    Elastic,
    /// A random one, on rigid cables.
    Random,
}

impl RigKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Elastic, Self::Random];
}

/// Distance of the targets from the start, m.
const DISTANCE_M: std::ops::Range<f64> = 0.08..0.25;
/// Smallest share of each motor in the barycentric coordinates of a place.
const LEAST_SHARE: f64 = 0.08;
/// Smallest distance of a place below the motors, m.
const BELOW_M: f64 = 0.08;
/// Smallest distance of a place from the workspace's sides, m: room for a ball that brakes.
const ROOM_M: f64 = 0.04;
/// Box in which the start lies on the paper's rig, m.
const STARTS: [std::ops::Range<f64>; 3] = [0.15..0.75, 0.15..0.45, 0.1..0.55];
/// Ways that are drawn from a start before another one is drawn.
const TRIES: usize = 200;

/// Rig, start and targets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    pub(super) geometry: Geometry,
    /// Start, m.
    pub(super) start: Point3<f64>,
    /// The first target, and the one in the opposite direction, m.
    pub(super) targets: [Point3<f64>; 2],
}

impl Places {
    /// Draws the places of a run, within the `workspace` and the reach of taut cables.
    pub(super) fn draw(kind: RigKind, workspace: &Workspace, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(11);
        let candidates = (0..).flat_map(|index| [index; TRIES]).map(|index| {
            let task = match kind {
                RigKind::Random => Population::default().sample(seed, index).expect("a rig"),
                RigKind::Paper | RigKind::Elastic => Task::paper(),
            };
            let start = match kind {
                RigKind::Random => task.start,
                _ => STARTS.map(|range| random.random_range(range)).into(),
            };
            let way = Vector3::from([(); 3].map(|()| random.random_range(-1.0..1.0)));
            let way = way.normalize() * random.random_range(DISTANCE_M);
            Self { geometry: task.geometry, start, targets: [start + way, start - way] }
        });
        candidates
            .into_iter()
            .find(|places| places.are_within_reach(workspace))
            .expect("an endless sequence")
    }

    /// Returns whether taut cables hold the ball at every place, with room to the workspace's
    /// sides.
    fn are_within_reach(&self, workspace: &Workspace) -> bool {
        let is_inside = |place: Point3<f64>| {
            Point::from_metres(place.into()).is_some_and(|place| workspace.contains(place))
        };
        let [room, motors] = [Vector3::repeat(ROOM_M), Vector3::z() * BELOW_M];
        [self.start, self.targets[0], self.targets[1]].into_iter().all(|place| {
            self.geometry.motors().iter().all(|motor| place.z + motors.z < motor.z)
                && self.geometry.barycentric(&place).iter().all(|share| *share > LEAST_SHARE)
                && is_inside(place - room)
                && is_inside(place + room)
        })
    }
}
