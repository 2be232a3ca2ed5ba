//! The real control loop and link with a camera that repeats one picture, in virtual time: the
//! message says what to do next.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::Cell;
use std::sync::atomic::AtomicBool;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_config::error_chain::ErrorChain;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{MotionLimits, Run as Repetition};
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Micros;
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{PathPlan, Run, RunParts};
use plumb_sim::simulated::{Timing, VirtualBoard};
use plumb_tests::links::{FixedDetector, TrackingCamera};
use plumb_vision::frame::RgbdFrame;

/// Number of frames to the target, or along the path, before the camera repeats one: 1 s.
const FRESH: usize = 30;

/// A camera that repeats one picture with new time stamps, once `is_frozen`.
struct Frozen<'a, S> {
    camera: S,
    is_frozen: &'a Cell<bool>,
    last: Option<RgbdFrame>,
}

impl<S: CameraSource> CameraSource for Frozen<'_, S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(frame) = self.camera.next_frame()? else { return Ok(None) };
        if !self.is_frozen.get() {
            self.last = None;
        }
        let last = self.last.get_or_insert_with(|| frame.clone()).clone();
        let repeated = last.with_time(frame.time());
        Ok(Some(repeated.map_err(InvalidFrame::of("the repeated picture"))?))
    }

    fn now(&self) -> f64 {
        self.camera.now()
    }

    fn is_live(&self) -> bool {
        self.camera.is_live()
    }
}

/// Observer that freezes the picture after [`FRESH`] frames to the target, or along the path.
struct Freezer<'a> {
    is_frozen: &'a Cell<bool>,
    along_path: bool,
    frames: usize,
}

impl Observer for Freezer<'_> {
    fn frame(&mut self, record: &FrameRecord) {
        self.frames += usize::from(record.path.is_some() == self.along_path);
        self.is_frozen.set(self.frames >= FRESH);
    }
}

/// Drives to a target of the paper, or along a path, until the camera repeats one picture. Returns
/// the message of the error, and the board's state at the end.
fn drive(along_path: bool) -> (String, State) {
    let rig = Rig { law: LawSettings::from(LawName::Adaptive), ..Rig::paper().unwrap() };
    let task = Task::paper();
    let plant = Box::new(QuasiStatic::new(task.geometry, task.start).unwrap());
    let simulated = VirtualBoard::new(plant);
    simulated.board().borrow_mut().run_to(Micros(10_000)).unwrap();
    let camera = camera_file::paper().unwrap();
    let tracking = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
    let is_frozen = &Cell::new(false);
    let mut source = Frozen { camera: tracking, is_frozen, last: None };
    let mut run = Run::connect(&rig, simulated.transport()).unwrap();
    if along_path {
        run.set_path(path(&rig)).unwrap();
    }
    let error = run
        .drive(RunParts {
            source: &mut source,
            detector: &mut FixedDetector(camera),
            observers: &mut [&mut Freezer { is_frozen, along_path, frames: 0 }],
            operator: None,
            timeout: 60.0,
            interrupted: &AtomicBool::new(false),
        })
        .unwrap_err();
    let state = simulated.board().borrow().state();
    (ErrorChain(&error).to_string(), state)
}

/// Returns a circle of 15 cm at 5 cm/s.
fn path(rig: &Rig) -> PathPlan {
    let shape = Shape {
        kind: ShapeKind::Circle,
        centre: Point3::new(0.45, 0.30, 0.325),
        size: 0.15,
        plane: Plane::Level,
        tolerance: 0.005,
        seed: 1,
    };
    let trajectory = shape.trajectory(&MotionLimits::with_speed(0.05), Repetition::Once).unwrap();
    PathPlan::new(trajectory, true, rig).unwrap()
}

#[test]
fn on_the_way_to_a_target_the_board_has_a_fault_to_clear() {
    let (message, state) = drive(false);
    assert_eq!(state, State::Fault(Fault::PositionLost));
    assert!(message.contains("the camera repeats one picture"), "{message}");
    assert!(message.ends_with("Connect the camera anew, then clear the fault"), "{message}");
}

/// A path waits for the ball, so that the host gives the camera up before the board's deadline.
#[test]
fn along_a_path_the_message_names_no_fault_that_the_board_does_not_have() {
    let (message, state) = drive(true);
    assert!(!matches!(state, State::Fault(_)), "{state:?}");
    assert!(message.contains("the camera repeats one picture"), "{message}");
    assert!(message.ends_with("Connect the camera anew"), "{message}");
}
