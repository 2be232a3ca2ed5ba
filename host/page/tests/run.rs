//! A run in virtual time with a page: commands reach the board, and hostile clients change no bit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use std::cell::RefCell;
use std::io::Write;
use std::net::SocketAddr;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use common::{Client, connect, page};
use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_page::Limits;
use plumb_protocol::message::{State, Telemetry};
use plumb_runtime::observer::{FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand, OperatorReceiver, operator};
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts, Summary};
use plumb_sim::memory::Memory;
use plumb_sim::simulated::{SimulatedCamera, Timing, VirtualRig};
use plumb_sim::synthetic::{Background, RenderOptions, Room, SyntheticCamera};
use plumb_vision::detect::DetectorKind;
use tungstenite::Message;

/// Drives the paper's rig to its target in virtual time.
fn drive(observers: Vec<&mut dyn Observer>, operator: Option<OperatorReceiver>) -> Summary {
    let rig = Rig { law: LawSettings::default(), ..Rig::paper().unwrap() };
    let task = Task::paper();
    let motors = *task.geometry.motors();
    let plant = QuasiStatic::new(task.geometry, task.start).unwrap();
    let board = Rc::new(RefCell::new(EmulatedBoard::with_plant(EMULATED, Box::new(plant))));
    let camera = camera_file::paper().unwrap();
    let room = Background::Room(Room::furnished());
    let synthetic =
        SyntheticCamera::new(camera.clone(), room, RenderOptions::default(), 1).unwrap();
    let simulated = VirtualRig::new(Rc::clone(&board)).unwrap();
    let mut source = SimulatedCamera::new(simulated, synthetic, motors, Timing::default());
    let run = Run::connect(&rig, Memory::new(board)).unwrap();
    let mut observers: Vec<&mut dyn Observer> =
        observers.into_iter().map(|observer| observer as &mut dyn Observer).collect();
    let parts = RunParts {
        source: &mut source,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut observers,
        operator,
        timeout: 60.0,
        interrupted: &AtomicBool::new(false),
    };
    run.drive(parts).unwrap()
}

/// What must not change: every position and every telemetry.
#[derive(Default, PartialEq, Debug)]
struct Trace(Vec<(f64, Option<Point3<f64>>, Option<Telemetry>)>);

impl Observer for Trace {
    fn frame(&mut self, record: &FrameRecord) {
        self.0.push((record.time, record.position(), record.telemetry));
    }
}

/// Starts clients that break the rules until the flag is set.
fn attack(address: SocketAddr, done: &Arc<AtomicBool>) -> Vec<JoinHandle<()>> {
    let until_done = |attack: fn(SocketAddr)| {
        let done = Arc::clone(done);
        thread::spawn(move || {
            while !done.load(Ordering::Relaxed) {
                attack(address);
            }
        })
    };
    vec![
        until_done(|address| {
            let Ok(mut flood) = Client::open(address, "", None) else { return };
            while flood.0.write(Message::text("{\"type\":\"stop\"}")).is_ok() {}
        }),
        until_done(|address| {
            let mut request = connect(address);
            while request.write_all(&[b'x'; 4096]).is_ok() {}
        }),
        until_done(|address| {
            let idle: Vec<_> = (0..50).map(|_| connect(address)).collect();
            drop(idle);
        }),
        until_done(|address| {
            assert_eq!(Client::open(address, "", Some("http://evil.example")).err(), Some(403));
        }),
    ]
}

#[test]
fn dead_and_hostile_clients_change_no_bit_of_a_run() {
    let mut alone = Trace::default();
    let expected = drive(vec![&mut alone], None);
    assert!(expected.reached);

    let (mut page, address) = page("127.0.0.1", Limits::DEFAULT, None);
    let mut dead = Client::open(address, "", None).unwrap();
    dead.wait_for("hello");
    let mut reader = Client::open(address, "", None).unwrap();
    reader.wait_for("hello");
    let reader = thread::spawn(move || std::iter::from_fn(|| reader.next()).count());
    let done = Arc::new(AtomicBool::new(false));
    let attackers = attack(address, &done);
    let mut trace = Trace::default();
    let summary = drive(vec![&mut page, &mut trace], None);
    done.store(true, Ordering::Relaxed);
    drop(page);
    assert!(reader.join().unwrap() > 0);
    // An attack that the end of the page has cut off fails; that is no surprise.
    attackers.into_iter().for_each(|attacker| drop(attacker.join()));
    assert_eq!(summary, expected);
    assert_eq!(trace, alone);
}

/// Person at a page, who sends messages after given frames.
struct Person {
    client: Client,
    /// Frame number and message, in this order.
    script: Vec<(u64, &'static str)>,
    /// Telemetry of each frame.
    telemetry: Vec<Option<Telemetry>>,
    events: Vec<RunEvent>,
}

impl Person {
    /// Sends a message and waits until the page has handled it: messages keep their order.
    fn send(&mut self, text: &str) {
        self.client.send(text);
        self.client.send("?");
        self.client.wait_for("problem");
    }
}

impl Observer for Person {
    fn frame(&mut self, record: &FrameRecord) {
        self.telemetry.push(record.telemetry);
        let due = self.script.first().is_some_and(|(number, _)| *number == record.number);
        if due {
            let (_, text) = self.script.remove(0);
            self.send(text);
        }
    }

    fn event(&mut self, event: &RunEvent) {
        self.events.push(event.clone());
    }
}

#[test]
fn commands_of_a_page_reach_the_board() {
    let (sender, receiver) = operator();
    let (mut page, address) = page("127.0.0.1", Limits::DEFAULT, Some(sender));
    let mut person = Person {
        client: Client::open(address, "", None).unwrap(),
        script: vec![
            (20, r#"{"type":"stop"}"#),
            (60, r#"{"type":"jog","motor":"B","steps":-16,"rate":40}"#),
            (100, r#"{"type":"target","x":0.5,"y":0.3,"z":0.3}"#),
            (101, r#"{"type":"target","x":0.5,"y":0.3,"z":7}"#),
            (200, r#"{"type":"hold"}"#),
            (240, r#"{"type":"clear"}"#),
            (250, r#"{"type":"end"}"#),
        ],
        telemetry: Vec::new(),
        events: Vec::new(),
    };
    let summary = drive(vec![&mut page, &mut person], Some(receiver));
    drop(page);

    let state = |frame: usize| person.telemetry[frame].unwrap().state;
    let turns = |frame: usize| person.telemetry[frame].unwrap().rates.iter().any(|r| r.0 != 0);
    assert_eq!((state(20), turns(20)), (State::Seeking, true));
    assert!(matches!(state(21), State::Stopping | State::Ready), "{:?}", state(21));
    assert_eq!([(state(40), turns(40)), (state(60), turns(60))], [(State::Ready, false); 2]);
    assert!((61..100).any(|frame| state(frame) == State::Jogging));
    assert!((101..200).any(|frame| state(frame) == State::Holding), "the target is reached");
    // A Hold waits until the motors rest and the ball's position has settled.
    assert_eq!(state(235), State::Holding);
    let refused = |event: &RunEvent| match event {
        RunEvent::Command { command, outcome: CommandOutcome::Refused(_), .. } => Some(*command),
        _ => None,
    };
    let refused: Vec<OperatorCommand> = person.events.iter().filter_map(refused).collect();
    assert_eq!(refused[0], OperatorCommand::Target(Point3::new(0.5, 0.3, 7.0)), "{refused:?}");
    assert!(!summary.legs[0].reached && summary.legs[1].reached, "{:?}", summary.legs);
    assert!(summary.at_rest);
}
