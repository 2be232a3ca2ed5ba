//! A node of Cyclone DDS in another process: `peer.py`.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

/// Longest wait for anything.
const LIMIT: Duration = Duration::from_secs(60);

/// Time after which a call that has no answer is repeated.
const AGAIN: Duration = Duration::from_millis(100);

/// Distance within which the ball is at a place, metres.
const NEAR: f64 = 0.010;

/// Largest age of a position of the ball when it comes, seconds. A busy machine holds it.
const MAX_AGE_S: f64 = 2.0;

/// Domain of ROS 2 that no other test of this computer uses at the same time.
pub(crate) struct Domain {
    number: u16,
    python: PathBuf,
    /// Lock between programs: the port belongs to the domain.
    _lock: TcpListener,
}

impl Domain {
    /// Reserves a domain. Returns `None` where no Python has cyclonedds; with CI set, that fails
    /// the test.
    pub(crate) fn reserve() -> Option<Self> {
        let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/ros2/bin/python");
        let has_package = |python: &PathBuf| {
            let import = ["-c", "import cyclonedds.domain"];
            Command::new(python).args(import).output().is_ok_and(|it| it.status.success())
        };
        let Some(python) = [PathBuf::from("python3"), kept].into_iter().find(has_package) else {
            assert!(std::env::var_os("CI").is_none(), "no Python has cyclonedds: scripts/ros2");
            println!("skipped: no Python has cyclonedds (scripts/ros2)");
            return None;
        };
        let reserve = |number: u16| {
            let lock = TcpListener::bind(("127.0.0.1", 7160 + number)).ok()?;
            Some(Self { number, python: python.clone(), _lock: lock })
        };
        Some((1..=99).find_map(reserve).unwrap())
    }

    pub(crate) fn number(&self) -> u16 {
        self.number
    }

    /// Returns a command that runs a script beside this file in the domain.
    pub(crate) fn script(&self, name: &str, arguments: &[&str]) -> Command {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stacks/ros2");
        let mut command = Command::new(&self.python);
        command.arg(folder.join(name)).arg(self.number.to_string()).args(arguments);
        command
    }
}

/// The node; killed when dropped.
pub(crate) struct Peer {
    child: Child,
    lines: Receiver<Value>,
    /// The newest message of the latched topic `stop_status`, null before the first one.
    stop: Value,
}

impl Peer {
    pub(crate) fn start(domain: &Domain, namespace: &str, options: &[&str]) -> Self {
        let mut child = domain
            .script("peer.py", &[&[namespace], options].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let _ = sender.send(serde_json::from_str(&line).unwrap());
            }
        });
        let mut peer = Self { child, lines, stop: Value::Null };
        peer.next("ready");
        peer
    }

    /// Sends a command to the node.
    pub(crate) fn send(&mut self, command: &Value) {
        writeln!(self.child.stdin.as_mut().unwrap(), "{command}").unwrap();
    }

    /// Calls a service. Returns its answer.
    pub(crate) fn call(&mut self, service: &str) -> Value {
        self.send(&json!({"call": service}));
        self.until("answer", |answer| answer["call"] == service)
    }

    /// Calls a service again and again until it answers. Returns the answer and how long that took.
    pub(crate) fn call_again(&mut self, service: &str) -> (Value, Duration) {
        let begin = Instant::now();
        while begin.elapsed() < LIMIT {
            self.send(&json!({"call": service}));
            let sent = Instant::now();
            while let Some(left) = AGAIN.checked_sub(sent.elapsed()) {
                let Ok(mut line) = self.line(left) else { break };
                if let Some(answer) = line.get_mut("answer") {
                    return (answer.take(), begin.elapsed());
                }
            }
        }
        panic!("no answer in time");
    }

    /// Returns the next line of the node. Keeps the newest state of Stop on the way.
    fn line(&mut self, limit: Duration) -> Result<Value, RecvTimeoutError> {
        let line = self.lines.recv_timeout(limit)?;
        if let Some(stop) = line.get("stop") {
            self.stop = stop.clone();
        }
        Ok(line)
    }

    /// Waits until the newest state of Stop is one for which `is_wanted`. It may have come before,
    /// on the way to another message.
    pub(crate) fn until_stop(&mut self, is_wanted: impl Fn(&Value) -> bool) -> Value {
        if is_wanted(&self.stop["values"]) {
            return self.stop.clone();
        }
        self.until("stop", |stop| is_wanted(&stop["values"]))
    }

    /// Returns the next message of this kind that comes from now on.
    pub(crate) fn next(&mut self, kind: &str) -> Value {
        self.until(kind, |_| true)
    }

    /// Returns the next message of this kind for which `is_wanted`.
    pub(crate) fn until(&mut self, kind: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
        // The newest message of each name, for the report of a failure.
        let (begin, mut newest) = (Instant::now(), Map::new());
        loop {
            match self.line(LIMIT.saturating_sub(begin.elapsed())) {
                Ok(mut line) => {
                    let Some(message) = line.get_mut(kind) else { continue };
                    if is_wanted(message) {
                        return message.take();
                    }
                    newest.insert(message["name"].to_string(), message.take());
                }
                Err(RecvTimeoutError::Timeout) => {
                    panic!("no {kind} in time; the newest: {}", Value::Object(newest))
                }
                Err(RecvTimeoutError::Disconnected) => panic!("the node has ended"),
            }
        }
    }

    /// Returns the next status of this name whose message contains `text`.
    pub(crate) fn until_status(&mut self, name: &str, text: &str) -> Value {
        self.until("status", |status| {
            status["name"] == name && status["message"].as_str().unwrap().contains(text)
        })
    }

    /// Waits until the node has joined ROS 2 again after an interruption. A busy computer may hold
    /// it up once more.
    pub(crate) fn until_joined_again(&mut self) {
        self.until("status", |status| {
            let joined = status["values"]["joined"].as_str().and_then(|it| it.parse::<u64>().ok());
            joined.is_some_and(|times| times >= 2)
        });
    }

    /// Waits until the rig holds the ball at a target, metres.
    pub(crate) fn until_held(&mut self, namespace: &str, target: [f64; 3]) {
        self.until("status", |status| is_held(status, namespace, target));
    }

    /// Sends the command `drive` to `target` (metres), and waits until the rig holds the ball
    /// there. A busy computer may interrupt ROS 2 once more, which stops the rig: then it is
    /// resumed, and the command is sent again after `pause`.
    pub(crate) fn drive(
        &mut self,
        drive: &Value,
        namespace: &str,
        target: [f64; 3],
        pause: Duration,
    ) {
        let begin = Instant::now();
        while begin.elapsed() < LIMIT {
            // What has come meanwhile: a stop may stand already.
            while self.line(Duration::ZERO).is_ok() {}
            if self.is_stopped() {
                println!("interrupted once more: {}", self.stop);
                assert_eq!(self.call_again("resume").0["success"], true);
                thread::sleep(pause);
                continue;
            }
            self.send(drive);
            while !self.is_stopped() && begin.elapsed() < LIMIT {
                let Ok(line) = self.line(LIMIT) else { panic!("no status in time") };
                if is_held(&line["status"], namespace, target) {
                    return;
                }
            }
        }
        panic!("not held in time; the newest stop: {}", self.stop);
    }

    /// Returns whether a stop stands, by the newest status.
    fn is_stopped(&self) -> bool {
        self.stop["values"]["number"].as_str().is_some_and(|number| number != "0")
    }

    /// Checks that the ball is at a place, metres.
    pub(crate) fn assert_ball_at(&mut self, place: [f64; 3]) {
        let ball = self.next("ball");
        let square = |k: usize| (ball["at"][k].as_f64().unwrap() - place[k]).powi(2);
        let distance = (0..3).map(square).sum::<f64>().sqrt();
        assert!(distance < NEAR, "{distance} m from {place:?}: {ball}");
    }

    /// Checks the ages of thirty positions of the ball when they come, seconds: `least` is that of
    /// the camera's latency.
    pub(crate) fn assert_ages(&mut self, least: f64) {
        let ages: Vec<f64> = (0..30).map(|_| self.next("ball")["age"].as_f64().unwrap()).collect();
        assert!(ages.iter().all(|age| (least..MAX_AGE_S).contains(age)), "{ages:?}");
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns whether a status says that the rig holds the ball at a target, metres.
fn is_held(status: &Value, namespace: &str, target: [f64; 3]) -> bool {
    let target = target.map(|metres| format!("{metres:.3}")).join(" ");
    let values = &status["values"];
    status["name"] == format!("{namespace}: run")
        && values["state"] == "holding"
        && values["target_m"] == target
}
