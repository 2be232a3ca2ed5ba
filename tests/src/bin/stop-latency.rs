//! Time from an operator's Stop to the start of the ramp on the board, in real time: rendered
//! frames of 640x480 at 30 Hz, the detector `ball`, a pseudo-terminal, an emulated board.
//!
//! Usage: `stop-latency [COUNT] [page [flood]]`. Prints a line for each Stop and the extremes,
//! milliseconds. With `page` the commands go through the page's WebSocket, while another client
//! takes the pictures. With `flood` a third client sends 10 000 messages a second, and connects
//! again where the page ends its connection.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::capture::{Capture, CaptureLimits};
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, Served, serve};
use plumb_page::{Limits, Page, PageSettings, RigView};
use plumb_protocol::message::State;
use plumb_runtime::link::Serial;
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::{BEGINS_ANEW_AFTER, OperatorCommand, OperatorSender, operator};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::{ServedRig, SimulatedCamera, Timing};
use plumb_sim::synthetic::{Background, RenderOptions, Room, SyntheticCamera};
use plumb_vision::detect::DetectorKind;
use tungstenite::{Message, WebSocket};

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
    let has_word = |word: &str| std::env::args().skip(2).any(|it| it == word);
    let mut page = has_word("page").then(|| start_page(&rig, sender.clone()));
    let flood = page.as_ref().filter(|_| has_word("flood")).map(|page| flood(page.address()));
    let commands = match &page {
        Some(page) => Commands::Page(watched(page.address()).into()),
        None => Commands::Direct(sender),
    };
    let person = thread::spawn(move || measure(commands, &served, count));
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(page.as_mut().map(|page| page as &mut dyn Observer));
    let summary = run.drive(RunParts {
        source: &mut capture,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut observers,
        operator: Some(receiver),
        timeout: 600.0,
        interrupted: &AtomicBool::new(false),
    });
    let summary = summary.expect("an unbroken run");
    let mut latencies = person.join().expect("no panic");
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
    if let Some(flood) = flood {
        let [messages, connections] =
            [&flood.messages, &flood.connections].map(|count| count.load(Ordering::Relaxed));
        println!("flood: {messages} messages on {connections} connections");
    }
}

/// What a client has done that sends as much as it can.
#[derive(Default)]
struct Flood {
    messages: AtomicU64,
    connections: AtomicU64,
}

/// Sends 10 000 messages a second to the page at this address, in a thread that ends with the page.
fn flood(address: &str) -> Arc<Flood> {
    let flood = Arc::new(Flood::default());
    let (done, address) = (Arc::clone(&flood), address.to_owned());
    thread::spawn(move || {
        while let Some(mut socket) = open(&address) {
            done.connections.fetch_add(1, Ordering::Relaxed);
            let begin = Instant::now();
            for number in 0_u32.. {
                // A tenth of a millisecond for each, or at once after a delay.
                let due = number * Duration::from_micros(100);
                thread::sleep(due.saturating_sub(begin.elapsed()));
                if socket.send(Message::text(r#"{"type":"seen","update":0}"#)).is_err() {
                    break;
                }
                done.messages.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
    flood
}

/// Way of the commands to the run.
enum Commands {
    Direct(OperatorSender),
    Page(Box<WebSocket<TcpStream>>),
}

impl Commands {
    fn send(&mut self, command: OperatorCommand) {
        match self {
            Self::Direct(sender) => drop(sender.send(command).expect("a run that goes on")),
            Self::Page(socket) => {
                socket.send(Message::text(json(command))).expect("an open page");
            }
        }
    }
}

/// Returns the message of a page for a command.
fn json(command: OperatorCommand) -> String {
    match command {
        OperatorCommand::Stop => r#"{"type":"stop"}"#.to_owned(),
        OperatorCommand::Resume { stop } => format!(r#"{{"type":"resume","stop":{stop}}}"#),
        OperatorCommand::Target(target) => {
            format!(r#"{{"type":"target","x":{},"y":{},"z":{}}}"#, target.x, target.y, target.z)
        }
        _ => r#"{"type":"end"}"#.to_owned(),
    }
}

/// Starts a page at a free port of this computer.
fn start_page(rig: &Rig, sender: OperatorSender) -> Page {
    let address = "127.0.0.1:0".parse().expect("an address");
    // The client that sends the commands acknowledges no update.
    let limits = Limits { silence: Duration::from_secs(3600), ..Limits::DEFAULT };
    let (rig, operator) = (RigView::of(rig), Some(sender));
    Page::start(PageSettings { address, rig, operator, limits }).expect("a page")
}

/// Opens the page twice: for the commands, and in a thread that takes the updates and pictures.
fn watched(address: &str) -> WebSocket<TcpStream> {
    let mut watcher = open(address).expect("a page that listens");
    thread::spawn(move || {
        while let Ok(message) = watcher.read() {
            let Message::Text(text) = message else { continue };
            let message: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            if message["type"] == "update" {
                let seen = format!(r#"{{"type":"seen","update":{}}}"#, message["number"]);
                if watcher.send(Message::text(seen)).is_err() {
                    return;
                }
            }
        }
    });
    open(address).expect("a page that listens")
}

/// Opens the WebSocket of the page at this address; `None` where no page answers.
fn open(address: &str) -> Option<WebSocket<TcpStream>> {
    let host = address.trim_start_matches("http://").trim_end_matches('/');
    let stream = TcpStream::connect(host).ok()?;
    stream.set_nodelay(true).expect("a TCP socket");
    tungstenite::client(format!("ws://{host}/socket"), stream).ok().map(|(socket, _)| socket)
}

/// Stops `count` drives, at different times between two frames. Returns the latencies,
/// milliseconds, and ends the run.
fn measure(mut commands: Commands, served: &Served, count: usize) -> Vec<f64> {
    let mut latencies = Vec::new();
    for number in 0..count {
        wait_for(served, |state| state == State::Seeking);
        // Not a multiple of the period of the frames: the phase differs each time.
        thread::sleep(Duration::from_micros(500_000 + 7_300 * (number as u64 % 10)));
        let begin = Instant::now();
        commands.send(OperatorCommand::Stop);
        wait_for(served, |state| matches!(state, State::Stopping | State::Ready));
        let latency = begin.elapsed().as_secs_f64() * 1e3;
        println!("{latency:.1}");
        wait_for(served, |state| state == State::Ready);
        // A Stop, a Resume and a target in each turn.
        commands.send(OperatorCommand::Resume { stop: 3 * number as u64 + 1 });
        thread::sleep(BEGINS_ANEW_AFTER + Duration::from_millis(50));
        let target = Point3::from(TARGETS[(number + 1) % 2]);
        commands.send(OperatorCommand::Target(target));
        latencies.push(latency);
    }
    commands.send(OperatorCommand::End);
    latencies
}

/// Waits until the board is in such a state.
fn wait_for(served: &Served, is_wanted: impl Fn(State) -> bool) {
    while !is_wanted(served.board().state()) {
        thread::sleep(Duration::from_micros(200));
    }
}
