//! A board that falls silent is noticed within about a second of the link's time, whatever the rate
//! of the frames. In virtual time.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plumb_cameras::camera_file;
use plumb_emulator::wire::{Lane, Silence};
use plumb_emulator::{EmulatedBoard, Wire};
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{ControlLoopError, Run, RunError, RunParts, StopReason, Summary};
use plumb_sim::simulated::{Timing, VirtualBoard, VirtualRig};
use plumb_tests::links::{FixedDetector, TrackingCamera};
use plumb_vision::frame::RgbdFrame;

/// Start of the silence, µs on the board's clock.
const SILENT_FROM: u64 = 2_000_000;
/// Longest time until the run has ended, µs: a second to notice, and three Stops.
const NOTICED_WITHIN: u64 = 1_200_000;

/// Camera that stalls from `from` until `until`, µs on the board's clock.
struct Stalling {
    camera: TrackingCamera<VirtualRig>,
    board: Rc<RefCell<EmulatedBoard>>,
    from: u64,
    until: u64,
}

impl CameraSource for Stalling {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        while !self.wait(Duration::from_secs(1)) {}
        self.camera.next_frame()
    }

    fn now(&self) -> f64 {
        self.camera.now()
    }

    fn is_live(&self) -> bool {
        true
    }

    fn wait(&mut self, limit: Duration) -> bool {
        let now = self.board.borrow().now().0;
        if !(self.from..self.until).contains(&now) {
            return true;
        }
        let end = Micros(now + limit.as_micros() as u64);
        self.board.borrow_mut().run_to(end).expect("a rig that follows");
        end.0 >= self.until
    }
}

/// Runs with a camera of `rate` frames/s that stalls in `stall` (µs), over a link that is silent
/// in `silence` (µs). Returns the result and the time of its end, µs on the board's clock.
fn run(
    rate: f64,
    stall: std::ops::Range<u64>,
    silence: std::ops::Range<u64>,
) -> (Result<Summary, RunError>, u64) {
    let rig = Rig::paper().expect("the paper's rig file");
    let silences = vec![Silence { from: Micros(silence.start), to: Micros(silence.end) }];
    let wire = Wire { silences, ..Wire::symmetric(Lane::default(), 1) };
    let simulated = VirtualBoard::paper().expect("the paper's rig").with_wire(wire);
    let board = simulated.board();
    let camera = camera_file::paper().expect("the paper's camera");
    let timing = Timing { rate, ..Timing::default() };
    let tracking = TrackingCamera::new(simulated.rig(), camera.clone(), timing);
    let (from, until) = (stall.start, stall.end);
    let mut source = Stalling { camera: tracking, board: Rc::clone(board), from, until };
    let run = Run::connect(&rig, simulated.transport()).expect("a configured board");
    let result = run.drive(RunParts {
        source: &mut source,
        detector: &mut FixedDetector(camera),
        observers: &mut [],
        operator: None,
        timeout: 60.0,
        interrupted: &AtomicBool::new(false),
    });
    let end = board.borrow().now().0;
    (result, end)
}

/// Checks that a silent board is the cause, and is noticed in time.
fn expect_silence((result, end): (Result<Summary, RunError>, u64)) {
    let RunError::Broken { error, summary } = result.expect_err("a silent board") else {
        panic!("the run never began")
    };
    let is_silent = matches!(&error, ControlLoopError::Link(LinkError::NoTelemetry { .. }));
    assert!(is_silent, "{error:?}");
    assert!(end - SILENT_FROM <= NOTICED_WITHIN, "noticed after {} us", end - SILENT_FROM);
    assert!(!summary.at_rest && !summary.reached, "{summary:?}");
}

#[test]
fn a_silent_board_is_noticed_within_a_second_at_any_rate_of_frames() {
    for rate in [5.0, 30.0, 200.0] {
        expect_silence(run(rate, 0..0, SILENT_FROM..60_000_000));
    }
}

#[test]
fn a_silent_board_is_noticed_while_the_camera_stalls() {
    expect_silence(run(30.0, SILENT_FROM..30_000_000, SILENT_FROM..60_000_000));
}

#[test]
fn a_board_that_stops_for_want_of_positions_is_noticed_while_the_camera_stalls() {
    let (result, end) = run(30.0, SILENT_FROM..30_000_000, 0..0);
    let summary = result.expect("a run that ends in order");
    // The host is there: it asks for the board's state while it waits for pictures.
    assert_eq!(summary.ending, StopReason::Fault(Fault::PositionLost.into()), "{summary:?}");
    // The deadline is 0.5 s; the rest is the ramp.
    assert!(end - SILENT_FROM < 2_000_000 && summary.at_rest, "{end} us, {summary:?}");
}
