//! Frames of a run: a source that is not live drives no board, and the observers receive every
//! frame.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::fs;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_cameras::tum::TumFolder;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_frame::camera::Intrinsics;
use plumb_frame::detect::{BallDetector, DetectError};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::units::Micros;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts};
use plumb_sim::memory::Memory;
use plumb_vision::detect::DetectorKind;

/// Camera on the board's clock that delivers this number of empty frames, and skips two before
/// each.
struct EmptyFrames {
    board: Rc<RefCell<EmulatedBoard>>,
    left: u32,
    skipped: u64,
}

impl CameraSource for EmptyFrames {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        self.skipped += 2;
        let now = self.board.borrow().now().0;
        self.board.borrow_mut().run_to(Micros(now + 33_000)).unwrap();
        let intrinsics = Intrinsics {
            fx: 1.0,
            fy: 1.0,
            cx: 0.5,
            cy: 0.5,
            depth_scale: 1000.0,
            distortion: None,
        };
        let (colour, depth) = (Image::filled(2, 2, [1; 3]), Image::filled(2, 2, 1));
        Ok(Some(RgbdFrame::new(self.now(), colour, depth, intrinsics).unwrap()))
    }

    fn now(&self) -> f64 {
        self.board.borrow().now().0 as f64 * 1e-6
    }

    fn is_live(&self) -> bool {
        true
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// Detector that cannot search every second frame.
#[derive(Default)]
struct Unreliable(u32);

impl BallDetector for Unreliable {
    fn name(&self) -> &'static str {
        "unreliable"
    }

    fn detect(&mut self, _: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        self.0 += 1;
        if self.0.is_multiple_of(2) { Err(DetectError::processing("no memory")) } else { Ok(None) }
    }
}

/// Observer that notes the numbers of the frames, and the numbers of those that are lost.
#[derive(Default)]
struct Notes {
    frames: Vec<u64>,
    lost: Vec<u64>,
}

impl Observer for Notes {
    fn frame(&mut self, record: &FrameRecord) {
        assert!(record.frame.is_some());
        self.frames.push(record.number);
    }

    fn event(&mut self, record: &EventRecord) {
        if matches!(&record.event, RunEvent::FrameLost { message } if message.contains("no memory"))
        {
            self.lost.extend(self.frames.last());
        }
    }
}

#[test]
fn a_frame_that_the_detector_cannot_search_is_recorded() {
    let board = Rc::new(RefCell::new(EmulatedBoard::new(EMULATED)));
    let run = Run::connect(&Rig::paper().unwrap(), Memory::new(Rc::clone(&board))).unwrap();
    let mut notes = Notes::default();
    let summary = run.drive(RunParts {
        source: &mut EmptyFrames { board, left: 6, skipped: 100 },
        detector: &mut Unreliable::default(),
        observers: &mut [&mut notes],
        operator: None,
        timeout: 10.0,
        interrupted: &AtomicBool::new(false),
    });
    let summary = summary.unwrap();
    assert_eq!((summary.frames, summary.lost), (6, 3));
    // Frames that the source skipped before the run do not count.
    assert_eq!(summary.skipped, 12);
    assert_eq!(notes.frames, [0, 1, 2, 3, 4, 5]);
    assert_eq!(notes.lost, [1, 3, 5]);
}

#[test]
fn a_source_that_is_not_live_is_refused_before_the_board_receives_a_target() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("depth.txt"), "").unwrap();
    fs::write(folder.path().join("rgb.txt"), "0.0 gone.png\n").unwrap();
    let camera = camera_file::paper().unwrap();
    let mut recording = TumFolder::open(folder.path(), camera.intrinsics).unwrap();
    let board = Rc::new(RefCell::new(EmulatedBoard::new(EMULATED)));
    let run = Run::connect(&Rig::paper().unwrap(), Memory::new(Rc::clone(&board))).unwrap();
    let ready = board.borrow().state();
    let result = run.drive(RunParts {
        source: &mut recording,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut [],
        operator: None,
        timeout: 10.0,
        interrupted: &AtomicBool::new(false),
    });
    assert!(matches!(result, Err(RunError::NotLive)), "{result:?}");
    assert_eq!(board.borrow().state(), ready);
}
