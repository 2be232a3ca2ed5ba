//! Frames of a run: a source that is not live drives no board.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::fs;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_cameras::source::tum::TumFolder;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts};
use plumb_sim::memory::Memory;
use plumb_vision::detect::DetectorKind;

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
        timeout: 10.0,
        interrupted: &AtomicBool::new(false),
    });
    assert!(matches!(result, Err(RunError::NotLive)), "{result:?}");
    assert_eq!(board.borrow().state(), ready);
}
