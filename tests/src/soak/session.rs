//! One session: a host connects to the board, drives, and goes.

use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Micros;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::operator::operator;
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunError, RunParts, StopReason};
use plumb_sim::simulated::{Timing, VirtualBoard, VirtualRig};
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Disturbance;
use super::operator::RandomOperator;
use crate::links::{FixedDetector, TrackingCamera};

/// Pictures a second.
const RATE: f64 = 30.0;
/// Shortest and longest session, seconds.
const LENGTH: std::ops::Range<f64> = 10.0..400.0;
/// Time after a session in which the motors come to rest: longer than a deadline and a ramp.
const REST: u64 = 2_000_000;

/// Plan of a session.
pub(super) struct Session {
    disturbance: Disturbance,
    law: LawName,
    /// Number of pictures.
    length: u64,
    seed: u64,
}

/// Result of a session.
pub(super) struct SessionResult {
    pub(super) reached: usize,
    pub(super) targets: usize,
    pub(super) frames: u64,
    /// Reported cause of the end.
    pub(super) cause: String,
    pub(super) violations: Vec<String>,
}

/// How a session ended.
struct Ending {
    cause: String,
    /// Whether the disturbance is needed to explain it.
    is_unexpected: bool,
}

impl Session {
    /// Draws a session that begins `now`.
    pub(super) fn draw(random: &mut ChaCha8Rng, now: Micros) -> Self {
        // Most sessions are short.
        let length = random.random_range(LENGTH) * random.random_range(0.1..1.0_f64);
        let laws = LawName::ALL;
        Self {
            disturbance: Disturbance::draw(random, now, length),
            law: laws[random.random_range(0..laws.len())],
            length: (length * RATE) as u64,
            seed: random.random(),
        }
    }

    pub(super) fn disturbance(&self) -> Disturbance {
        self.disturbance
    }

    /// Drives the session, and inspects the board after it.
    ///
    /// # Panics
    /// If the paper's camera file cannot be read, or the simulated rig fails.
    pub(super) fn run(&self, virtual_board: &VirtualBoard, rig: &Rig) -> SessionResult {
        let board = virtual_board.board();
        board.borrow_mut().set_wire(Default::default());
        let mut violations = Vec::new();
        if let Err(error) = make_ready(virtual_board) {
            violations.push(format!("not ready: {}", ErrorChain(&error)));
        }
        board.borrow_mut().set_wire(self.disturbance.wire(self.seed));
        let (sender, receiver) = operator();
        let random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut operator = RandomOperator::new(sender, random, board.clone(), self.length);
        let camera = camera_file::paper().expect("the paper's camera");
        let camera_of_rig =
            TrackingCamera::new(virtual_board.rig(), camera.clone(), Timing::default());
        let mut source = PausingCamera { inner: camera_of_rig, disturbance: self.disturbance };
        let rig = Rig { law: LawSettings::from(self.law), ..rig.clone() };
        let result = Run::connect(&rig, virtual_board.transport()).and_then(|run| {
            run.drive(RunParts {
                source: &mut source,
                detector: &mut FixedDetector(camera.clone()),
                observers: &mut [&mut operator],
                operator: Some(receiver),
                timeout: f64::INFINITY,
                interrupted: &AtomicBool::new(false),
            })
        });
        let Ending { cause, is_unexpected } = ending(result);
        if is_unexpected && !self.disturbance.may_end_a_session() {
            violations.push(format!("an undisturbed session ended: {cause}"));
        }
        let end = Micros(board.borrow().now().0 + REST);
        board.borrow_mut().run_to(end).expect("a rig that follows");
        let (rates, state) = (board.borrow().rates(), board.borrow().state());
        if rates != [0.0; 3] {
            violations.push(format!("the motors turn after the session ({state})"));
        }
        let RandomOperator { reached, targets, frames, false_claims, .. } = operator;
        violations.extend(false_claims);
        SessionResult { reached, targets, frames, cause, violations }
    }
}

/// Clears what the session before left behind, as an operator does. A ball that has fallen in a
/// restart is hung again. After a Travel fault the motors get a new zero of travel where they
/// stand: a board that has restarted counts from there.
fn make_ready(board: &VirtualBoard) -> Result<(), LinkError> {
    let mut link = Link::connect(board.transport())?;
    if let State::Fault(fault) = link.status()?.state {
        if fault == Fault::Watchdog {
            board.board().borrow_mut().hang_again();
        }
        link.clear_fault()?;
        if matches!(fault, Fault::Travel(_)) {
            link.home()?;
        }
    }
    Ok(())
}

fn ending(result: Result<plumb_runtime::run::Summary, RunError>) -> Ending {
    match result {
        Ok(summary) => {
            let by_travel = matches!(
                summary.ending,
                StopReason::Fault(BoardFault { fault: Fault::Travel(_), .. })
            );
            let is_unexpected = !summary.ending.is_chosen() && !by_travel;
            Ending { cause: summary.ending.to_string(), is_unexpected }
        }
        Err(RunError::Broken { error, .. }) => {
            Ending { cause: ErrorChain(&error).to_string(), is_unexpected: true }
        }
        Err(error) => Ending { cause: ErrorChain(&error).to_string(), is_unexpected: true },
    }
}

/// A camera that delivers nothing for a while, if that is the disturbance.
struct PausingCamera {
    inner: TrackingCamera<VirtualRig>,
    disturbance: Disturbance,
}

impl CameraSource for PausingCamera {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let frame = self.inner.next_frame()?;
        let Disturbance::CameraGap(from, seconds) = self.disturbance else { return Ok(frame) };
        let begin = from.0 as f64 * 1e-6;
        let is_paused = |now: f64| (begin..begin + seconds).contains(&now);
        let mut frame = frame;
        while is_paused(self.inner.now()) {
            frame = self.inner.next_frame()?;
        }
        Ok(frame)
    }

    fn now(&self) -> f64 {
        self.inner.now()
    }

    fn is_live(&self) -> bool {
        true
    }
}
