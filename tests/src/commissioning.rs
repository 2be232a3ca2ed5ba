//! Rigs with a known fault of wiring, cable or pose, and their examination in virtual time with a
//! camera's noise.

mod cases;
mod eye;

pub use cases::{Case, Mistake};
pub use eye::NoisyDetector;

use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_runtime::link::Link;
use plumb_setup::commission::{Examination, ExaminationError, Report};
use plumb_setup::watch::{WatchError, WatchParts};
use plumb_sim::simulated::{Timing, VirtualBoard};

use crate::links::{FixedDetector, TrackingCamera};

/// Distance of the camera from the origin along x, metres: beyond every rig of the population.
const CAMERA_X_M: f64 = 4.0;

/// Examines the rig of `case`.
///
/// # Errors
/// Those of [`Examination::run`].
pub fn examine(case: &Case) -> Result<Report, ExaminationError> {
    let board = VirtualBoard::new(case.plant());
    let mut camera = camera_file::paper().expect("the paper's camera");
    camera.pose.translation.x = CAMERA_X_M;
    let mut source = TrackingCamera::new(board.rig(), camera.clone(), Timing::default());
    let mut detector = NoisyDetector::new(FixedDetector(camera), case.seen(), case.seed);
    let mut link = Link::connect(board.transport()).map_err(WatchError::from)?;
    link.configure(
        case.rig.wiring().expect("a wiring"),
        case.rig.config().expect("a rig file in range"),
    )
    .map_err(WatchError::from)?;
    let mut parts = WatchParts {
        source: &mut source,
        detector: &mut detector,
        observers: &mut [],
        progress: &mut |_| (),
        interrupted: &AtomicBool::new(false),
    };
    Examination::run(&case.rig, &mut link, &mut parts)
}
