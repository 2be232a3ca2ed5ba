//! A run in virtual time with a page: commands reach the board, and hostile clients change no bit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::common::{Client, connect, page};
use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_page::Limits;
use plumb_protocol::message::State;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand, OperatorReceiver, operator};
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::Summary;
use plumb_sim::simulated::VirtualBoard;
use plumb_vision::detect::DetectorKind;
use serde_json::Value;
use tungstenite::Message;

/// Limits for a page that answers when it is due in the script: between two acts a busy computer
/// needs longer than a page may be silent.
const PATIENT: Limits = Limits { silence: Duration::from_secs(600), ..Limits::DEFAULT };

fn rig() -> Rig {
    Rig { law: LawSettings::default(), ..Rig::paper().unwrap() }
}

/// Drives the paper's rig to its target in virtual time.
fn drive(observers: Vec<&mut dyn Observer>, operator: Option<OperatorReceiver>) -> Summary {
    let (board, camera) = (VirtualBoard::paper().unwrap(), camera_file::paper().unwrap());
    let mut detector = DetectorKind::Ball.build(&camera);
    board.drive(&rig(), &camera, &mut *detector, observers, operator).unwrap()
}

/// What must not change: every position and every report of the board.
#[derive(Default, PartialEq, Debug)]
struct Trace(Vec<(f64, Option<Point3<f64>>, Option<BoardReport>)>);

impl Observer for Trace {
    fn frame(&mut self, record: &FrameRecord) {
        self.0.push((record.time, record.position(), record.board));
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

/// What a person does.
#[derive(Clone, Copy)]
enum Act {
    /// Sends a message.
    Send(&'static str),
    /// Leaves the page at this address and opens it anew.
    Leave(SocketAddr, Departure),
}

/// How a page goes away.
#[derive(Debug, Clone, Copy)]
enum Departure {
    /// The connection is closed.
    Closed,
    /// The connection stays, without answers: the network is lost.
    Silent,
}

/// Person at a page, who acts after given frames.
struct Person {
    client: Client,
    /// Clients that do not answer.
    silent: Vec<Client>,
    /// Frame number and act, in this order.
    script: Vec<(u64, Act)>,
    /// Report of the board at each frame.
    reports: Vec<Option<BoardReport>>,
    events: Vec<RunEvent>,
}

impl Person {
    fn new(address: SocketAddr, script: Vec<(u64, Act)>) -> Self {
        let client = Client::open(address, "", None).unwrap();
        let (silent, reports, events) = (Vec::new(), Vec::new(), Vec::new());
        Self { client, silent, script, reports, events }
    }

    /// Leaves the page, opens it anew, and waits until the program has noticed.
    fn come_back(&mut self, address: SocketAddr, departure: Departure) {
        let next = Client::open(address, "", None).unwrap();
        let before = std::mem::replace(&mut self.client, next);
        if let Departure::Silent = departure {
            self.silent.push(before);
        }
        let is_gone = |update: Value| update["events"].to_string().contains("is gone");
        while !is_gone(self.client.wait_for("update")) {}
    }

    /// Sends a message and waits until the page has handled it: messages keep their order.
    fn send(&mut self, text: &str) {
        self.client.send(text);
        self.client.send("?");
        self.client.wait_for("problem");
    }
}

impl Observer for Person {
    fn frame(&mut self, record: &FrameRecord) {
        self.reports.push(record.board);
        let due = self.script.first().is_some_and(|(number, _)| *number == record.number);
        if due {
            match self.script.remove(0).1 {
                Act::Send(text) => self.send(text),
                Act::Leave(address, departure) => self.come_back(address, departure),
            }
        }
    }

    fn event(&mut self, record: &EventRecord) {
        let event = &record.event;
        self.events.push(event.clone());
    }
}

#[test]
fn commands_of_a_page_reach_the_board() {
    let (sender, receiver) = operator();
    let (mut page, address) = page("127.0.0.1", PATIENT, Some(sender));
    let script = vec![
        (20, Act::Send(r#"{"type":"stop"}"#)),
        (50, Act::Send(r#"{"type":"resume","stop":1}"#)),
        (60, Act::Send(r#"{"type":"jog","motor":"B","steps":-16,"rate":40}"#)),
        (100, Act::Send(r#"{"type":"target","x":0.5,"y":0.3,"z":0.3}"#)),
        (101, Act::Send(r#"{"type":"target","x":0.5,"y":0.3,"z":7}"#)),
        (200, Act::Send(r#"{"type":"hold"}"#)),
        (240, Act::Send(r#"{"type":"clear"}"#)),
        (250, Act::Send(r#"{"type":"end"}"#)),
    ];
    let mut person = Person::new(address, script);
    let summary = drive(vec![&mut page, &mut person], Some(receiver));
    drop(page);

    let state = |frame: usize| person.reports[frame].unwrap().state;
    let turns = |frame: usize| person.reports[frame].unwrap().rates.iter().any(|rate| *rate != 0.0);
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

/// Returns the largest distance of a motor from its position in `from`, full steps.
fn travelled(reports: &[Option<BoardReport>], from: usize) -> f64 {
    let motors = |frame: usize| reports[frame].unwrap().motors;
    let last = motors(reports.len() - 1);
    motors(from).iter().zip(&last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Jogs a motor by 160 steps, which take 4 s, and leaves the page 1/30 s later. Returns how far
/// the motor turned, full steps.
fn abandoned_jog(departure: Departure) -> f64 {
    let (sender, receiver) = operator();
    let (mut page, address) = page("127.0.0.1", PATIENT, Some(sender));
    let mut person = Person::new(
        address,
        vec![
            (20, Act::Send(r#"{"type":"stop"}"#)),
            (50, Act::Send(r#"{"type":"resume","stop":1}"#)),
            (60, Act::Send(r#"{"type":"jog","motor":"B","steps":-160,"rate":40}"#)),
            (61, Act::Leave(address, departure)),
            (120, Act::Send(r#"{"type":"end"}"#)),
        ],
    );
    let summary = drive(vec![&mut page, &mut person], Some(receiver));
    assert!(summary.at_rest);
    travelled(&person.reports, 60)
}

#[test]
fn a_jog_ends_when_its_page_closes_or_falls_silent() {
    for departure in [Departure::Closed, Departure::Silent] {
        let steps = abandoned_jog(departure);
        assert!(steps > 0.0 && steps < 20.0, "{departure:?}: {steps} steps");
    }
}

#[test]
fn a_jog_out_of_range_is_refused_with_the_limits_in_words() {
    let (sender, _receiver) = operator();
    let (_page, address) = page("127.0.0.1", Limits::DEFAULT, Some(sender));
    let mut client = Client::open(address, "", None).unwrap();
    for jog in
        ["\"steps\":1e300,\"rate\":50", "\"steps\":20,\"rate\":1e300", "\"steps\":20,\"rate\":0"]
    {
        client.send(&format!(r#"{{"type":"jog","motor":"A",{jog}}}"#));
        let problem = client.wait_for("problem")["text"].as_str().unwrap().to_owned();
        assert!(problem.contains("200 steps") && problem.contains("50 steps/s"), "{problem}");
        assert!(problem.len() < 200, "{problem}");
    }
}
