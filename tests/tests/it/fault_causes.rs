//! The cause that is told beside a fault is what was counted: damaged frames, late wake-ups of this
//! program, positions that were too old. In virtual time.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use plumb_cameras::camera_file;
use plumb_emulator::wire::Lane;
use plumb_emulator::{EmulatedBoard, Wire};
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;
use plumb_runtime::board_fault::{BoardFault, FaultCause};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError, RunParts, StopReason, Summary};
use plumb_sim::simulated::{Timing, VirtualBoard, VirtualRig};
use plumb_tests::links::{FixedDetector, TrackingCamera};
use plumb_vision::frame::RgbdFrame;

/// When the trouble begins, µs on the board's clock.
const FROM_US: u64 = 1_000_000;

/// What happens to a run in its first move.
#[derive(Debug, Clone)]
enum Trouble {
    /// The pictures are older by this, seconds.
    Old(f64),
    /// The link becomes another one.
    Wire(Wire),
    /// The program does not wake for this long, once.
    Asleep(Duration),
    /// The program takes this long for each picture.
    Busy(Duration),
    /// The camera delivers nothing.
    Stall,
}

/// Camera of a run in trouble.
struct Troubled {
    camera: TrackingCamera<VirtualRig>,
    board: Rc<RefCell<EmulatedBoard>>,
    trouble: Trouble,
    has_begun: bool,
}

impl Troubled {
    fn run_for(&self, time: Duration) {
        let end = self.board.borrow().now().0 + time.as_micros() as u64;
        self.board.borrow_mut().run_to(Micros(end)).expect("a rig that follows");
    }
}

impl CameraSource for Troubled {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let frame = self.camera.next_frame();
        let now = self.board.borrow().now().0;
        let begins = !std::mem::replace(&mut self.has_begun, now >= FROM_US) && self.has_begun;
        match &self.trouble {
            Trouble::Wire(wire) if begins => self.board.borrow_mut().set_wire(wire.clone()),
            Trouble::Asleep(time) if begins => self.run_for(*time),
            Trouble::Busy(time) if self.has_begun => self.run_for(*time),
            _ => {}
        }
        frame
    }

    fn now(&self) -> f64 {
        match self.trouble {
            Trouble::Old(older) if self.has_begun => self.camera.now() + older,
            _ => self.camera.now(),
        }
    }

    fn is_live(&self) -> bool {
        true
    }

    fn wait(&mut self, limit: Duration) -> bool {
        if matches!(self.trouble, Trouble::Stall) && self.has_begun {
            self.run_for(limit);
            return false;
        }
        true
    }
}

/// Drives along a way that takes longer than the trouble needs.
fn run(trouble: Trouble) -> Result<Summary, RunError> {
    let rig = Rig::paper().expect("the paper's rig file");
    let simulated = VirtualBoard::paper().expect("the paper's rig");
    let simulated = simulated.with_wire(Wire::symmetric(Lane::default(), 1));
    let board = Rc::clone(simulated.board());
    let camera = camera_file::paper().expect("the paper's camera");
    let tracking = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
    let mut source = Troubled { camera: tracking, board, trouble, has_begun: false };
    let run = Run::connect(&rig, simulated.transport()).expect("a configured board");
    run.drive(RunParts::new(&mut source, &mut FixedDetector(camera)))
}

/// Returns the fault that ended a run in trouble.
fn fault_after(trouble: Trouble) -> BoardFault {
    let summary = match run(trouble.clone()) {
        Ok(summary) => summary,
        Err(RunError::Broken { summary, .. }) => *summary,
        Err(error) => panic!("{trouble:?}: {error:?}"),
    };
    let StopReason::Fault(fault) = summary.ending else { panic!("{trouble:?}: {summary:?}") };
    assert_eq!(summary.legs[0].ending, StopReason::Fault(fault), "{trouble:?}");
    fault
}

/// Returns a link whose frames to the board, and those to the host with `both`, are all damaged.
fn damaging(both: bool) -> Wire {
    let lane = |is_damaging| Lane { damaged: f64::from(u8::from(is_damaging)), ..Lane::default() };
    Wire { to_board: lane(true), to_host: lane(both), ..Wire::symmetric(Lane::default(), 1) }
}

#[test]
fn damaged_frames_to_the_board_are_the_cause_of_its_stop() {
    let fault = fault_after(Trouble::Wire(damaging(false)));
    let Some(FaultCause::DamagedFrames { damaged, sent }) = fault.cause else {
        panic!("{fault:?}");
    };
    assert_eq!(fault.fault, Fault::HostSilent);
    // A position is sent every 33 ms, and the board counts every 100 ms: two counts come within its
    // deadline of 0.3 s.
    assert!((4..=sent).contains(&damaged), "{fault}");
    assert!(fault.advice().contains("cable"), "{}", fault.advice());
}

#[test]
fn damaged_frames_from_the_board_are_no_silence() {
    let Err(RunError::Broken { error, .. }) = run(Trouble::Wire(damaging(true))) else {
        panic!("nothing came from the board");
    };
    let text = plumb_config::error_chain::ErrorChain(&error).to_string();
    assert!(text.contains("damaged on the wire"), "{text}");
    assert!(!text.contains("is it powered"), "{text}");
}

#[test]
fn a_program_that_wakes_late_is_the_cause_of_a_silent_host() {
    let fault = fault_after(Trouble::Asleep(Duration::from_millis(700)));
    let Some(FaultCause::LateHost { longest, .. }) = fault.cause else { panic!("{fault:?}") };
    assert_eq!(fault.fault, Fault::HostSilent);
    assert!((650..=800).contains(&longest.as_millis()), "{fault}");
    assert!(fault.to_string().contains("(this computer is overloaded or was asleep: "), "{fault}");
    assert!(fault.advice().contains("processor"), "{}", fault.advice());
}

#[test]
fn a_program_that_is_late_for_every_picture_is_the_cause_of_lost_positions() {
    let fault = fault_after(Trouble::Busy(Duration::from_millis(240)));
    let Some(FaultCause::LateHost { times, .. }) = fault.cause else { panic!("{fault:?}") };
    assert_eq!(fault.fault, Fault::PositionLost);
    assert!(times >= 2, "{fault}");
    assert!(!fault.advice().contains("lit"), "{}", fault.advice());
}

#[test]
fn positions_that_are_too_old_are_the_cause_of_lost_positions() {
    let fault = fault_after(Trouble::Old(0.3));
    let Some(FaultCause::OldPositions { oldest, .. }) = fault.cause else { panic!("{fault:?}") };
    assert_eq!(fault.fault, Fault::PositionLost);
    assert!((300..400).contains(&oldest.as_millis()), "{fault}");
}

#[test]
fn a_camera_that_stalls_has_no_other_cause() {
    let fault = fault_after(Trouble::Stall);
    assert_eq!(fault, Fault::PositionLost.into());
    assert!(fault.advice().contains("camera"), "{}", fault.advice());
}

#[test]
fn late_wake_ups_without_a_fault_stand_in_the_summary() {
    let late = |trouble| run(trouble).expect("no fault").late_wakeups;
    assert_eq!(late(Trouble::Old(0.0)), None);
    let Some(late) = late(Trouble::Asleep(Duration::from_millis(200))) else {
        panic!("a program that slept for 0.2 s");
    };
    assert!(late.times == 1 && (0.15..0.3).contains(&late.longest_s), "{late:?}");
    assert!(late.to_string().starts_with("this computer is overloaded: "), "{late}");
}
