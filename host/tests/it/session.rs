//! One session with a path, a fault and a refused command, in every output: the terminal, the
//! result, the run folder, the page and the MCAP file tell the same.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::process::Stdio;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use nix::sys::signal::Signal;
use serde_json::Value;
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

use crate::common::{Emulator, folder, page_address, patient, program, rig_file, send};
#[cfg(feature = "full")]
use crate::viewers::mcap_agrees;

/// Fault of a board whose host is held up.
const FAULT: &str = "the board has stopped by itself: nothing came from the host for too long";

/// What to do after it.
const ADVICE: &str = "Check what else uses the computer's processor";

/// Outcome of a target outside the workspace.
const REFUSED: &str = "go to (9.000, 9.000, 9.000) m: the target is outside the workspace";

/// Longest wait for something that must come.
const PATIENCE: Duration = Duration::from_secs(120);

/// An open page.
struct Page(tungstenite::WebSocket<TcpStream>);

impl Page {
    /// Opens the page at `address`.
    fn open(address: &str) -> Self {
        let request = format!("ws://{address}/socket").into_client_request().unwrap();
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        Self(socket)
    }

    fn send(&mut self, text: &str) {
        self.0.send(Message::text(text)).unwrap();
    }

    /// Takes updates until an event contains `text`. Returns the events until then.
    fn events_until(&mut self, text: &str) -> Vec<Value> {
        let is_there = |event: &Value| event["text"].as_str().unwrap().contains(text);
        self.until(|_, events| events.iter().any(is_there))
    }

    /// Takes updates until `is_enough` of the last one and of the events so far. Returns these.
    fn until(&mut self, is_enough: impl Fn(&Value, &[Value]) -> bool) -> Vec<Value> {
        let (mut events, end) = (Vec::new(), Instant::now() + PATIENCE);
        loop {
            assert!(Instant::now() < end, "{events:#?}");
            let Message::Text(message) = self.0.read().unwrap() else { continue };
            let message: Value = serde_json::from_str(&message).unwrap();
            if message["type"] != "update" {
                continue;
            }
            self.send(&format!(r#"{{"type":"seen","update":{}}}"#, message["number"]));
            events.extend(message["events"].as_array().unwrap().iter().cloned());
            if is_enough(&message, &events) {
                return events;
            }
        }
    }
}

/// Returns the event of a list whose text contains `text`.
fn with_text<'a>(events: &'a [Value], text: &str) -> &'a Value {
    let mut found = events.iter().filter(|event| event["text"].as_str().unwrap().contains(text));
    found.next().unwrap_or_else(|| panic!("no '{text}': {events:#?}"))
}

fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_millis() as u64
}

#[test]
fn a_fault_and_a_refused_command_stand_in_every_output() {
    let folder = folder();
    let edit = |text| patient(text).replace("host = 5.0", "host = 4.5");
    let rig = rig_file(folder.path(), edit);
    let path = "x,y,z\n0.52,0.25,0.42\n0.48,0.25,0.42\n";
    fs::write(folder.path().join("path.csv"), path).unwrap();
    let emulator = Emulator::in_real_time(&[]);
    let mut outputs = vec!["--page", "--page-address=127.0.0.1:0", "--out", "run", "--json"];
    if cfg!(feature = "full") {
        outputs.extend(["--mcap", "run.mcap"]);
    }
    let run = ["follow", "--rig", &rig, "path.csv", "--speed", "0.02", "--port", &emulator.port];
    let mut run = program(&[&run as &[&str], &outputs].concat(), folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(run.stderr.take().unwrap()).lines().map(Result::unwrap);
    let address = page_address(&mut lines);

    let mut page = Page::open(&address);
    // The path is under way.
    page.until(|update, _| {
        update["observation"]["path_pace"].as_f64().is_some_and(|pace| pace > 0.0)
    });
    // The host is held up for longer than the board waits for it.
    send(&run, Signal::SIGSTOP);
    std::thread::sleep(Duration::from_secs(6));
    send(&run, Signal::SIGCONT);
    let happened = now_ms();
    let told = lines.find(|line| line.contains(FAULT)).unwrap();
    assert!(told.contains(ADVICE), "{told}");
    page.send(r#"{"type":"target","x":9,"y":9,"z":9}"#);
    page.events_until(REFUSED);
    // A page that comes later sees when each event happened.
    std::thread::sleep(Duration::from_secs(1));
    let events = Page::open(&address).events_until(REFUSED);
    let fault = with_text(&events, FAULT);
    assert!(fault["text"].as_str().unwrap().contains(ADVICE) && fault["tone"] == "bad", "{fault}");
    let late = fault["at_ms"].as_u64().unwrap().abs_diff(happened);
    assert!(late < now_ms() - happened, "{fault}: {late} ms");

    send(&run, Signal::SIGINT);
    let rest: Vec<String> = lines.collect();
    assert!(rest.iter().any(|line| line.contains(REFUSED)), "{rest:?}");
    let last = rest.last().unwrap();
    assert!(last.starts_with("interrupted: ") && last.contains(ADVICE), "{last}");
    let mut result = String::new();
    run.stdout.take().unwrap().read_to_string(&mut result).unwrap();
    run.wait().unwrap();
    let summary: Value = serde_json::from_str(result.lines().last().unwrap()).unwrap();
    let events = summary["events"].as_array().unwrap();
    let fault = with_text(events, FAULT);
    assert_eq!((&fault["kind"], &fault["ok"]), (&"target_ended".into(), &false.into()));
    assert!(fault["advice"].as_str().unwrap().contains(ADVICE), "{fault}");
    let refused = with_text(events, REFUSED);
    assert_eq!(refused["target_m"].to_string(), "[9.0,9.0,9.0]");
    assert!(refused["time_s"].as_f64() >= fault["time_s"].as_f64(), "{refused} {fault}");
    assert!(summary["path"]["frames"].as_u64().is_some(), "{summary}");

    let rows = fs::read_to_string(folder.path().join("run/run.csv")).unwrap();
    let stopped = rows.lines().filter(|row| row.contains("nothing came from the host")).count();
    assert!(stopped > 10, "{stopped} rows have the fault");
    #[cfg(feature = "full")]
    mcap_agrees(folder.path(), &["--events"]);
}
