//! A link that breaks after a fault: the run ends for the fault, and the break is told beside it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_frame::camera::Intrinsics;
use plumb_frame::detect::{BallDetector, DetectError};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Micros;
use plumb_runtime::link::{LinkError, Transport};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts, StopReason, Summary};
use plumb_sim::memory::Memory;

type SharedBoard = Rc<RefCell<EmulatedBoard>>;

/// Moment at which the link breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Break {
    /// Before the first bytes after a fault.
    BeforeTheFault,
    /// In the read after that of the fault.
    InTheNextRead,
    /// In the write after the read of the fault.
    InTheNextWrite,
}

/// Link in memory that breaks around a fault of its board.
struct Breaking {
    memory: Memory,
    board: SharedBoard,
    moment: Break,
    /// Whether the bytes after the fault were delivered.
    delivered: bool,
}

impl Breaking {
    fn lost(&self) -> LinkError {
        LinkError::Lost { port: self.name(), source: io::Error::other("unplugged") }
    }
}

impl Transport for Breaking {
    fn name(&self) -> String {
        self.memory.name()
    }

    fn now(&self) -> Duration {
        self.memory.now()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        if self.delivered { Err(self.lost()) } else { self.memory.send(bytes) }
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let is_faulted = matches!(self.board.borrow().state(), State::Fault(_));
        if (is_faulted && self.moment == Break::BeforeTheFault)
            || (self.delivered && self.moment == Break::InTheNextRead)
        {
            return Err(self.lost());
        }
        let before = bytes.len();
        self.memory.receive(bytes, wait)?;
        self.delivered |= is_faulted && bytes.len() > before;
        Ok(())
    }
}

/// Camera on the board's clock whose frames are empty.
struct EmptyFrames(SharedBoard);

impl CameraSource for EmptyFrames {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let now = self.0.borrow().now().0;
        self.0.borrow_mut().run_to(Micros(now + 33_000)).unwrap();
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
        self.0.borrow().now().0 as f64 * 1e-6
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// Detector that finds no ball.
struct NoBall;

impl BallDetector for NoBall {
    fn name(&self) -> &'static str {
        "no ball"
    }

    fn detect(&mut self, _: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        Ok(None)
    }
}

/// Returns the summary of a run whose board stops because no frame shows the ball.
fn run(moment: Break) -> Summary {
    let board = Rc::new(RefCell::new(EmulatedBoard::new(EMULATED)));
    let memory = Memory::new(Rc::clone(&board));
    let link = Breaking { memory, board: Rc::clone(&board), moment, delivered: false };
    let run = Run::connect(&Rig::paper().unwrap(), link).unwrap();
    let error = run.drive(RunParts::new(&mut EmptyFrames(board), &mut NoBall)).unwrap_err();
    let RunError::Broken { summary, .. } = error else { panic!("{error:?}") };
    *summary
}

#[test]
fn a_link_that_breaks_after_a_fault_does_not_hide_it() {
    for moment in [Break::InTheNextRead, Break::InTheNextWrite] {
        let summary = run(moment);
        let fault = StopReason::Fault(Fault::PositionLost.into());
        assert_eq!(summary.ending, fault, "{moment:?}");
        assert_eq!(summary.legs[0].ending, fault, "{moment:?}");
        assert!(!summary.reached && !summary.at_rest, "{moment:?}: {summary:?}");
        let failure = summary.failure.unwrap_or_default();
        assert!(failure.contains("the board was unplugged"), "{moment:?}: {failure}");
    }
}

#[test]
fn a_link_that_breaks_before_the_fault_arrives_is_the_reason_of_the_end() {
    let summary = run(Break::BeforeTheFault);
    assert!(summary.ending.to_string().contains("the board was unplugged"), "{summary:?}");
    assert_eq!(summary.failure, None);
}

#[test]
fn a_run_without_a_ball_claims_no_error() {
    let summary = run(Break::InTheNextWrite);
    assert!(summary.frames > 0, "{summary:?}");
    assert_eq!(
        (summary.located, summary.filtered_error_mm, summary.legs[0].filtered_error_mm),
        (0, None, None)
    );
}
