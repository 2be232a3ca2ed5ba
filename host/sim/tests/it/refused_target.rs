//! A board that refuses a target is stopped, and the run waits until its motors stand still.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plumb_cameras::camera_file;
use plumb_config::error_chain::ErrorChain;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{ControlLoopError, Run, RunError, RunParts};
use plumb_sim::memory::Memory;
use plumb_vision::detect::DetectorKind;

/// A camera on the board's clock that loses every frame.
struct Lossy(Rc<RefCell<EmulatedBoard>>);

impl CameraSource for Lossy {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let now = self.0.borrow().now().0;
        self.0.borrow_mut().run_to(Micros(now + 33_000)).unwrap();
        Err(SourceError::new("a lost frame"))
    }

    fn now(&self) -> f64 {
        self.0.borrow().now().0 as f64 * 1e-6
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// Drives towards the rig's target for a second.
fn move_motors(rig: &Rig, board: &Rc<RefCell<EmulatedBoard>>) {
    let target = rig.targets().unwrap()[0];
    let [x, y, z] = target.to_metres();
    let ball = Point::from_metres([x, y, z + 0.2]).unwrap();
    let mut link = Link::connect(Memory::new(Rc::clone(board))).unwrap();
    link.configure(rig.wiring().unwrap(), rig.config().unwrap()).unwrap();
    link.set_target(target).unwrap();
    for _ in 0..30 {
        link.position(Some(ball), None, Duration::ZERO).unwrap();
        let now = board.borrow().now().0;
        board.borrow_mut().run_to(Micros(now + 33_000)).unwrap();
    }
}

#[test]
fn a_board_that_refuses_a_target_is_stopped_and_waited_for() {
    let mut rig = Rig::paper().unwrap();
    let camera = camera_file::paper().unwrap();
    let board = Rc::new(RefCell::new(EmulatedBoard::new(EMULATED)));
    move_motors(&rig, &board);
    rig.motors.travel = [-1.0, 1.0].map(|steps| steps.try_into().unwrap());
    let run = Run::connect(&rig, Memory::new(Rc::clone(&board))).unwrap();
    let result = run.drive(RunParts {
        source: &mut Lossy(board),
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut [],
        operator: None,
        timeout: 10.0,
        interrupted: &AtomicBool::new(false),
    });
    let error = result.unwrap_err();
    let message = ErrorChain(&error).to_string();
    assert!(message.contains("stands outside its travel"), "{message}");
    assert!(ErrorChain(&error).errors().any(|error| error.is::<ControlLoopError>()));
    assert!(ErrorChain(&error).errors().any(|error| error.is::<LinkError>()));
    let RunError::Broken { summary, .. } = error else { panic!("{error:?}") };
    assert!(summary.at_rest);
}
