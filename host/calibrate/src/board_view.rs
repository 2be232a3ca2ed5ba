//! The board's corners over several frames of a board at rest.

use nalgebra::{Point2, Vector2};
use plumb_frame::frame::RgbdFrame;

use crate::board::Board;
use crate::board_pose::MIN_CORNERS;
use crate::calibration::CalibrationError;
use crate::corners::BoardCorner;
use crate::depth::depth_near;

/// Share of the frames in which a corner must be seen.
const MIN_SHARE: f64 = 0.5;
/// Standard deviation of a corner over the frames above which something moved, pixels.
const MAX_SPREAD: f64 = 1.0;
/// Radius of the square from which the depth at a corner is taken, pixels.
const DEPTH_RADIUS: i32 = 2;

/// A corner over several frames of a board at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenCorner {
    /// Number of the corner.
    pub id: usize,
    /// The corner on the board, board axes, metres.
    pub board: Point2<f64>,
    /// Mean of its images, pixels.
    pub image: Point2<f64>,
    /// Median of its depths, metres; `None` where the frames have none.
    pub depth: Option<f64>,
}

/// Corners of one frame with the frame's depths.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BoardView {
    corners: Vec<(BoardCorner, Option<f64>)>,
}

impl BoardView {
    /// Adds the depths of a frame to its corners.
    pub fn new(corners: &[BoardCorner], frame: &RgbdFrame) -> Self {
        let depth = |corner: &BoardCorner| depth_near(frame, &corner.image, DEPTH_RADIUS);
        Self { corners: corners.iter().map(|corner| (*corner, depth(corner))).collect() }
    }
}

/// Averages the corners over frames of a board at rest.
///
/// # Errors
/// If the board moved, or too few corners are seen in most of the frames.
pub fn average(views: &[BoardView], board: &Board) -> Result<Vec<SeenCorner>, CalibrationError> {
    let mut seen = Vec::new();
    let mut variance = 0.0;
    for (id, place) in board.corners().into_iter().enumerate() {
        let of_corner = |view: &BoardView| view.corners.iter().find(|it| it.0.id == id).copied();
        let images: Vec<_> = views.iter().filter_map(of_corner).collect();
        let n = images.len() as f64;
        if n < 1.0 || n < MIN_SHARE * views.len() as f64 {
            continue;
        }
        let mean = images.iter().map(|it| it.0.image.coords).sum::<Vector2<f64>>() / n;
        variance +=
            images.iter().map(|it| (it.0.image.coords - mean).norm_squared()).sum::<f64>() / n;
        let mut depths: Vec<f64> = images.iter().filter_map(|it| it.1).collect();
        depths.sort_by(f64::total_cmp);
        let depth = depths.get(depths.len() / 2).copied();
        seen.push(SeenCorner { id, board: place, image: mean.into(), depth });
    }
    if seen.len() < MIN_CORNERS {
        let what = "corners of the board";
        return Err(CalibrationError::TooFew { what, found: seen.len(), needed: MIN_CORNERS });
    }
    let pixels = (variance / seen.len() as f64).sqrt();
    if pixels > MAX_SPREAD {
        return Err(CalibrationError::Moved { what: "the board", pixels });
    }
    Ok(seen)
}
