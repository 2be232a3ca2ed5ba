//! Rigs with a known fault of wiring, cable or pose, and their examination in virtual time with a
//! camera's noise.

mod cases;
mod eye;

pub use cases::{Case, Mistake};
pub use eye::NoisyDetector;

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_runtime::commission::{Examination, ExaminationError, ExaminationParts, Report};
use plumb_runtime::link::Link;
use plumb_sim::memory::Memory;
use plumb_sim::simulated::{Timing, VirtualRig};

use crate::links::{FixedDetector, TrackingCamera};

/// Distance of the camera from the origin along x, metres: beyond every rig of the population.
const CAMERA_X_M: f64 = 4.0;

/// Examines the rig of `case`.
///
/// # Errors
/// Those of [`Examination::run`].
pub fn examine(case: &Case) -> Result<Report, ExaminationError> {
    let board = EmulatedBoard::with_plant(EMULATED, case.plant());
    let board = Rc::new(RefCell::new(board));
    let rig = VirtualRig::new(Rc::clone(&board)).expect("a board with a rig");
    let mut camera = camera_file::paper().expect("the paper's camera");
    camera.pose.translation.x = CAMERA_X_M;
    let mut source = TrackingCamera::new(rig, camera.clone(), Timing::default());
    let mut detector = NoisyDetector::new(FixedDetector(camera), case.seen(), case.seed);
    let mut link = Link::connect(Memory::new(board))?;
    link.configure(case.rig.config().expect("a rig file in range"))?;
    let mut parts = ExaminationParts {
        source: &mut source,
        detector: &mut detector,
        observers: &mut [],
        progress: &mut |_| (),
        interrupted: &AtomicBool::new(false),
    };
    Examination::run(&case.rig, link, &mut parts)
}
