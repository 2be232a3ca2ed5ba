//! Size of a new rig: the triangle of its motors, and limits that fit into it.

use nalgebra::{Point2, Point3, Vector2};
use thiserror::Error;

/// Sides that a rig can have, metres.
pub const SIDE_RANGE_M: [f64; 2] = [0.2, 3.5];
/// Heights of the guides above the floor, metres.
pub const HEIGHT_RANGE_M: [f64; 2] = [0.4, 3.5];

/// Least distance of C, along the side BA, from A and from B, as a share of that side.
const LEAST_SHARE: f64 = 0.02;
/// Size of the workspace's triangle, as a share of the motors' triangle with the same centroid.
const WORKSPACE_SHARE: f64 = 0.85;
/// Distance of the ball's surface from the floor, metres.
const FLOOR_MARGIN_M: f64 = 0.05;
/// Least distance of the workspace below the motors, metres, and as a share of their height.
const MOTOR_MARGIN_M: f64 = 0.1;
const MOTOR_MARGIN_SHARE: f64 = 0.15;
/// Largest distance of the workspace below the motors, metres: the simulations cover no larger one.
const MAX_DEPTH_M: f64 = 1.0;
/// Least height of the workspace, metres.
const LEAST_WORKSPACE_HEIGHT_M: f64 = 0.15;

/// Sides and height of a rig that Plumb cannot drive.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum SizeError {
    /// A length is out of its range.
    #[error("{name} is {value} m, but must be from {} to {} m", range[0], range[1])]
    Length {
        /// Name of the length.
        name: &'static str,
        /// Its value, metres.
        value: f64,
        /// Its range, metres.
        range: [f64; 2],
    },
    /// No triangle has these sides.
    #[error("no triangle has the sides AB {ab} m, BC {bc} m, CA {ca} m: measure them again")]
    NoTriangle {
        /// Side AB, metres.
        ab: f64,
        /// Side BC, metres.
        bc: f64,
        /// Side CA, metres.
        ca: f64,
    },
    /// The angle at A or B is not acute.
    #[error(
        "the angle at A or at B is not acute: C must lie between A and B, seen along the side \
         AB. Name the motors so that C is opposite the longest side, or move them"
    )]
    NotAcute,
    /// The ball has no room between floor and motors.
    #[error("a ball of {diameter} m has no room below motors at {height} m")]
    NoRoom {
        /// Diameter of the ball, metres.
        diameter: f64,
        /// Height of the motors above the floor, metres.
        height: f64,
    },
}

/// Checks that a length is in its range, metres.
pub(super) fn check_length(
    name: &'static str,
    value: f64,
    range: [f64; 2],
) -> Result<(), SizeError> {
    if (range[0]..=range[1]).contains(&value) {
        Ok(())
    } else {
        Err(SizeError::Length { name, value, range })
    }
}

/// Triangle of the motors at a height above the floor.
///
/// The origin of the rig frame is on the floor: at the x of motor C and the y of motor B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// y of motor A, metres: the side AB.
    side: f64,
    /// x of motors A and B, metres: the distance of C from the side AB.
    depth: f64,
    /// y of motor C, metres.
    offset: f64,
    /// z of the motors, metres.
    height: f64,
}

/// Box in the rig frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WorkspaceBox {
    pub(super) min: Point3<f64>,
    pub(super) max: Point3<f64>,
}

impl Triangle {
    /// Returns the triangle with these sides and this height of the guides above the floor,
    /// metres.
    ///
    /// # Errors
    /// Where a length is out of its range, or motors at these places have other signs Σ.
    pub fn new([ab, bc, ca]: [f64; 3], height: f64) -> Result<Self, SizeError> {
        check_length("side AB", ab, SIDE_RANGE_M)?;
        check_length("side BC", bc, SIDE_RANGE_M)?;
        check_length("side CA", ca, SIDE_RANGE_M)?;
        check_length("the height of the guides", height, HEIGHT_RANGE_M)?;
        let offset = (ab * ab + bc * bc - ca * ca) / (2.0 * ab);
        let depth = (bc * bc - offset * offset).sqrt();
        // Not a number where no triangle has these sides.
        if depth.is_nan() || depth < LEAST_SHARE * ab {
            return Err(SizeError::NoTriangle { ab, bc, ca });
        }
        if !(LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&(offset / ab)) {
            return Err(SizeError::NotAcute);
        }
        Ok(Self { side: ab, depth, offset, height })
    }

    /// Returns the places of motors A, B, C, metres in the rig frame.
    pub fn motors(&self) -> [Point3<f64>; 3] {
        let Self { side, depth, offset, height } = *self;
        [(depth, side), (depth, 0.0), (0.0, offset)].map(|(x, y)| Point3::new(x, y, height))
    }

    /// Returns the largest box inside a smaller triangle, above the floor and below the motors, for
    /// a ball of this diameter, metres.
    pub(super) fn workspace(&self, diameter: f64) -> Result<WorkspaceBox, SizeError> {
        let corners = self.motors().map(|motor| motor.xy());
        let sum: Vector2<f64> = corners.iter().map(|corner| corner.coords).sum();
        let centroid = Point2::from(sum / 3.0);
        let [a, b, c] = corners.map(|corner| centroid + WORKSPACE_SHARE * (corner - centroid));
        // The largest box in the triangle ends halfway between C and the side AB.
        let (low, high) = (nalgebra::center(&b, &c), nalgebra::center(&a, &c));
        let margin = MOTOR_MARGIN_M.max(MOTOR_MARGIN_SHARE * self.height);
        let top = self.height - margin;
        let bottom = (diameter / 2.0 + FLOOR_MARGIN_M).max(self.height - MAX_DEPTH_M);
        if top - bottom < LEAST_WORKSPACE_HEIGHT_M {
            return Err(SizeError::NoRoom { diameter, height: self.height });
        }
        Ok(WorkspaceBox {
            min: Point3::new(low.x, low.y, bottom),
            max: Point3::new(a.x, high.y, top),
        })
    }

    /// Returns the largest change of a cable's length within `workspace`, metres.
    pub(super) fn largest_change(&self, workspace: &WorkspaceBox) -> f64 {
        let change = |motor: &Point3<f64>| {
            let lengths = workspace.corners().map(|corner| (corner - motor).norm());
            let longest = lengths.iter().copied().fold(0.0, f64::max);
            longest - lengths.iter().copied().fold(f64::INFINITY, f64::min)
        };
        self.motors().iter().map(change).fold(0.0, f64::max)
    }
}

impl WorkspaceBox {
    /// Returns the point at these shares of the way from the smallest to the largest corner.
    pub(super) fn at(&self, shares: [f64; 3]) -> Point3<f64> {
        let size = self.max - self.min;
        self.min + nalgebra::Vector3::from(shares).component_mul(&size)
    }

    fn corners(&self) -> [Point3<f64>; 8] {
        std::array::from_fn(|n| self.at([n & 1, n >> 1 & 1, n >> 2].map(|bit| bit as f64)))
    }
}
