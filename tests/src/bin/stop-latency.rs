//! Time from an operator's Stop to the begin of the ramp on the board, in real time: rendered
//! frames of 640x480 at 30 Hz, the detector `ball`, a pseudo-terminal, an emulated board.
//!
//! Usage: `stop-latency [COUNT]`. Prints a line for each Stop and the extremes, milliseconds.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::source::capture::{Capture, CaptureLimits};
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, Served, serve};
use plumb_protocol::message::State;
use plumb_runtime::link::Serial;
use plumb_runtime::operator::{OperatorCommand, OperatorSender, operator};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::{ServedRig, SimulatedCamera, Timing};
use plumb_sim::synthetic::{Background, RenderOptions, Room, SyntheticCamera};
use plumb_vision::detect::DetectorKind;

/// Targets that the ball alternates between, metres in the rig frame.
const TARGETS: [[f64; 3]; 2] = [[0.40, 0.40, 0.15], [0.50, 0.28, 0.30]];

fn main() {
    let count = std::env::args().nth(1).map_or(20, |count| count.parse().expect("a count"));
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law = LawSettings::from(LawName::Taut);
    let camera = camera_file::paper().expect("the paper's camera");
    let task = Task::paper();
    let plant = QuasiStatic::new(task.geometry, task.start).expect("the paper's rig");
    let board = EmulatedBoard::with_plant(EMULATED, Box::new(plant));
    let served = Arc::new(serve(board).expect("a pseudo-terminal"));
    let simulated = ServedRig::new(Arc::clone(&served)).expect("a board with a rig");
    let background = Background::Room(Room::furnished());
    let synthetic = SyntheticCamera::new(camera.clone(), background, RenderOptions::default(), 1)
        .expect("a camera");
    let source =
        SimulatedCamera::new(simulated, synthetic, *task.geometry.motors(), Timing::default());
    let mut capture = Capture::start(source, CaptureLimits::default()).expect("a thread");
    let transport =
        Serial::open(&served.path().to_string_lossy(), rig.board.baud).expect("the port");
    let run = Run::connect(&rig, transport).expect("a configured board");
    let (sender, receiver) = operator();
    let page = thread::spawn(move || measure(&sender, &served, count));
    let summary = run.drive(RunParts {
        source: &mut capture,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut [],
        operator: Some(receiver),
        timeout: 600.0,
        interrupted: &AtomicBool::new(false),
    });
    let summary = summary.expect("an unbroken run");
    let mut latencies = page.join().expect("no panic");
    latencies.sort_by(f64::total_cmp);
    println!(
        "{} Stops: least {:.1}, median {:.1}, most {:.1} ms; {} frames, {} skipped",
        latencies.len(),
        latencies[0],
        latencies[latencies.len() / 2],
        latencies[latencies.len() - 1],
        summary.frames,
        summary.skipped
    );
}

/// Stops `count` drives, at different times between two frames. Returns the latencies,
/// milliseconds, and ends the run.
fn measure(sender: &OperatorSender, served: &Served, count: usize) -> Vec<f64> {
    let latencies = (0..count).map(|number| {
        wait_for(served, |state| state == State::Seeking);
        // Not a multiple of the period of the frames: the phase differs each time.
        thread::sleep(Duration::from_micros(500_000 + 7_300 * (number as u64 % 10)));
        let begin = Instant::now();
        sender.send(OperatorCommand::Stop).expect("a run that goes on");
        wait_for(served, |state| matches!(state, State::Stopping | State::Ready));
        let latency = begin.elapsed().as_secs_f64() * 1e3;
        println!("{latency:.1}");
        wait_for(served, |state| state == State::Ready);
        let target = Point3::from(TARGETS[(number + 1) % 2]);
        sender.send(OperatorCommand::Target(target)).expect("a run that goes on");
        latency
    });
    let latencies = latencies.collect();
    sender.send(OperatorCommand::End).expect("a run that goes on");
    latencies
}

/// Waits until the board is in such a state.
fn wait_for(served: &Served, is_wanted: impl Fn(State) -> bool) {
    while !is_wanted(served.board().state()) {
        thread::sleep(Duration::from_micros(200));
    }
}
