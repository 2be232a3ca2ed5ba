//! A node sees the ball, sets targets and calls services.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use serde_json::{Value, json};

use super::peer::{Domain, Peer};
use crate::common::{self, Emulator, folder, patient, rig_file};

/// Boards have deadlines: one test at a time.
pub(crate) static TURN: Mutex<()> = Mutex::new(());

/// Target of the paper, metres.
pub(crate) const PAPER: [f64; 3] = [0.4, 0.4, 0.15];

/// Silence after which a publisher begins anew, and a margin.
const ANEW: Duration = Duration::from_millis(1500);

/// Targets that may go to the board in a second.
const MAX_RATE: f64 = 20.0;

/// A run of a simulated rig in ROS 2; killed when dropped.
pub(crate) struct Run {
    child: Option<Child>,
    _emulator: Emulator,
    _folder: tempfile::TempDir,
}

impl Run {
    pub(crate) fn start(domain: &Domain, namespace: &str) -> Self {
        let folder = folder();
        let emulator = Emulator::in_real_time(&[]);
        rig_file(folder.path(), |text| patient(text.replace("/dev/ttyACM0", &emulator.port)));
        let child = Self::command(domain, namespace, folder.path()).spawn().unwrap();
        Self { child: Some(child), _emulator: emulator, _folder: folder }
    }

    pub(crate) fn command(domain: &Domain, namespace: &str, folder: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command
            .args(["run", "--out", "run", "--json"])
            .arg("--ros2")
            .arg(format!("--ros2-namespace={namespace}"))
            .arg(format!("--ros2-domain={}", domain.number()))
            .arg("--ros2-interface=127.0.0.1")
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Stops the program for a moment, as [`pause`].
    pub(crate) fn pause(&self) {
        pause(self.child.as_ref().unwrap());
    }

    /// Interrupts the run. Returns its summary.
    pub(crate) fn end(mut self) -> Value {
        let child = self.child.take().unwrap();
        common::send(&child, Signal::SIGINT);
        common::json(&child.wait_with_output().unwrap())
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Stops a program for 0.3 s. That interrupts all its waits, as Ctrl-Z and `fg`, a debugger and the
/// suspension of the computer do.
pub(crate) fn pause(child: &Child) {
    common::send(child, Signal::SIGSTOP);
    thread::sleep(Duration::from_millis(300));
    common::send(child, Signal::SIGCONT);
}

pub(crate) fn target(at: [f64; 3], frame: &str) -> Value {
    json!({"target": at, "frame": frame})
}

/// Returns how each leg of a summary ended.
pub(crate) fn endings(summary: &Value) -> Vec<&str> {
    let legs = summary["legs"].as_array().unwrap();
    legs.iter().map(|leg| leg["ending"].as_str().unwrap()).collect()
}

#[test]
fn a_node_sees_the_ball_and_drives_it() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let run = Run::start(&domain, "/plumb");
    peer.until_held("/plumb", PAPER);
    let ball = peer.next("ball");
    assert_eq!(ball["frame"], "plumb/rig", "{ball}");
    peer.assert_ball_at(PAPER);
    // The simulated camera delivers its pictures 45 ms after the exposure.
    peer.assert_ages(0.045);
    let pose = peer.next("pose");
    let variance = |k: usize| pose["covariance"][7 * k].as_f64().unwrap();
    assert!((0..3).all(|k| (1e-10..1e-4).contains(&variance(k))), "{pose}");
    let camera = peer.until("tf", |tf| tf["child"] == "plumb/camera");
    assert_eq!(camera["parent"], "plumb/rig", "{camera}");
    // The camera file's translation.
    let x = camera["at"][0].as_f64().unwrap();
    assert!((x - 1.737).abs() < 1e-9, "{camera}");
    peer.until("tf", |tf| tf["child"] == "plumb/ball");

    peer.send(&target([0.45, 0.3, 0.2], "plumb/rig"));
    peer.until_held("/plumb", [0.45, 0.3, 0.2]);
    peer.assert_ball_at([0.45, 0.3, 0.2]);
    for (sent, reason) in [
        (target([0.4, 0.3, 7.0], "plumb/rig"), "outside the workspace"),
        (target([0.4, 0.3, 0.2], "map"), "in the frame `map`"),
    ] {
        peer.send(&sent);
        let status = peer.until_status("/plumb: commands", reason);
        assert_eq!(status["level"], 1, "{status}");
    }
    // A vector has the bytes of a point.
    peer.send(&json!({"vector": [0.4, 0.3, 0.2]}));
    let status = peer.until_status("/plumb: graph", "geometry_msgs/msg/Vector3Stamped");
    assert_eq!(status["level"], 1, "{status}");
    peer.send(&json!({"best_effort": [0.4, 0.3, 0.2]}));
    let is_named = |status: &Value| {
        let values = status["values"].to_string();
        status["name"] == "/plumb: graph"
            && ["best effort", "Vector3Stamped"].iter().all(|text| values.contains(text))
    };
    peer.until("status", is_named);
    assert_eq!(peer.call("hold")["success"], true);
    peer.assert_ball_at([0.45, 0.3, 0.2]);
    let summary = run.end();
    assert_eq!(endings(&summary), ["reached", "reached"], "{summary}");
}

#[test]
fn a_stop_works_for_both_kinds_of_clients_and_under_a_flood_of_targets() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut flooding = Peer::start(&domain, "/hall/left", &[]);
    // A client as rmw_fastrtps_cpp is, the other as rmw_cyclonedds_cpp.
    let mut plain = Peer::start(&domain, "/hall/left", &["--plain"]);
    let mut right = Peer::start(&domain, "/right", &[]);
    let (left_run, right_run) = (Run::start(&domain, "/hall/left"), Run::start(&domain, "/right"));
    flooding.until_held("/hall/left", PAPER);
    plain.until_held("/hall/left", PAPER);
    right.until_held("/right", PAPER);
    let place = [0.45, 0.3, 0.2];
    let begin = Instant::now();
    flooding.send(&json!({"flood": place, "frame": "hall/left/rig"}));
    plain.until_status("/hall/left: run", "seeking");
    thread::sleep(Duration::from_secs(2));
    let answer = plain.call_again("stop").0;
    assert_eq!(answer["success"], true, "{answer}");
    let flood_s = begin.elapsed().as_secs_f64();
    // While it floods: the answer to the stop replaces what was refused before it.
    let refused = plain.until_status("/hall/left: commands", "/hall/left/resume");
    assert_eq!(refused["values"]["targets"], "refused since a stop", "{refused}");
    flooding.send(&json!({"calm": true}));
    let flooded = flooding.next("flooded").as_u64().unwrap() as f64;
    println!("{:.0} targets a second", flooded / flood_s);
    // Twenty times as many as may go to the board, also on a busy machine.
    assert!(flooded > 20.0 * MAX_RATE * flood_s, "{flooded} in {flood_s} s");
    // The other way to call a service.
    assert_eq!(flooding.call_again("resume").0["success"], true);
    thread::sleep(ANEW);
    flooding.send(&target(place, "hall/left/rig"));
    flooding.until_held("/hall/left", place);
    assert_eq!(flooding.call_again("stop").0["success"], true);
    right.assert_ball_at(PAPER);
    let (left, right) = (left_run.end(), right_run.end());
    assert_eq!(endings(&right), ["reached"], "{right}");
    // Those that went to the board until the stop.
    let endings = endings(&left);
    let stop = endings.iter().position(|ending| ending.starts_with("stopped"));
    let stop = stop.unwrap_or_else(|| panic!("{endings:?}"));
    assert_eq!(endings[stop + 1..], ["reached"], "{endings:?}");
    assert!(stop as f64 <= MAX_RATE * flood_s + 2.0, "{endings:?} in {flood_s} s");
}

/// Calls are lost until the run has joined ROS 2 anew: a stop could be among them.
#[test]
fn a_drive_that_was_interrupted_is_stopped_and_calls_are_answered_after_that() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(domain) = Domain::reserve() else { return };
    let mut peer = Peer::start(&domain, "/plumb", &[]);
    let run = Run::start(&domain, "/plumb");
    peer.until_held("/plumb", PAPER);
    let place = [0.45, 0.3, 0.2];
    peer.send(&target(place, "plumb/rig"));
    peer.until_status("/plumb: run", "seeking");
    run.pause();
    let (answer, waited) = peer.call_again("resume");
    assert_eq!(answer["success"], true, "{answer}");
    println!("answered {:.2} s after the interruption", waited.as_secs_f64());
    peer.until_status("/plumb: run", "ready");
    thread::sleep(ANEW);
    peer.drive(&target(place, "plumb/rig"), "/plumb", place, ANEW);
    let summary = run.end();
    // A drive that was interrupted once more was stopped as well.
    let endings = endings(&summary);
    let [first, interrupted @ .., last] = &endings[..] else { panic!("{summary}") };
    assert_eq!([first, last], [&"reached"; 2], "{summary}");
    assert!(!interrupted.is_empty(), "{summary}");
    assert!(interrupted.iter().all(|it| *it == "stopped by the operator"), "{summary}");
}
