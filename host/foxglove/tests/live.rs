//! The live server: a viewer that subscribes receives every topic; one that never reads changes
//! nothing.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::record::Overflow;
use plumb_foxglove::{FoxgloveError, FoxgloveOutput, FoxgloveSettings};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::Summary;
use plumb_sim::simulated::VirtualBoard;
use plumb_vision::detect::DetectorKind;
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::handshake::client::Request;
use tungstenite::{Message, WebSocket};

/// Longest wait of a viewer for a message.
const PATIENCE: Duration = Duration::from_secs(60);

fn rig() -> Rig {
    Rig { law: LawSettings::default(), ..Rig::paper().unwrap() }
}

/// Starts a live server at a free port.
fn server() -> (FoxgloveOutput, SocketAddr) {
    let server = Some("127.0.0.1:0".parse().unwrap());
    let settings = FoxgloveSettings { mcap: None, server };
    let output = FoxgloveOutput::start(&settings, &rig(), &camera_file::paper().unwrap()).unwrap();
    let address = SocketAddr::from(([127, 0, 0, 1], output.port().unwrap()));
    (output, address)
}

/// Subprotocol of viewers, and its former name.
const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Returns the request of a viewer.
fn handshake(address: SocketAddr, subprotocol: &str) -> Request {
    let mut request = format!("ws://{address}/").into_client_request().unwrap();
    request.headers_mut().insert("Sec-WebSocket-Protocol", subprotocol.parse().unwrap());
    request
}

/// Drives the paper's rig to its target in virtual time.
fn drive(observers: Vec<&mut dyn Observer>) -> Summary {
    let (board, camera) = (VirtualBoard::paper().unwrap(), camera_file::paper().unwrap());
    let mut detector = DetectorKind::Ball.build(&camera);
    board.drive(&rig(), &camera, &mut *detector, observers, None).unwrap()
}

/// A viewer.
struct Viewer {
    socket: WebSocket<TcpStream>,
    /// Topic by number of the subscription.
    topics: BTreeMap<u32, String>,
    /// Name of the schema by topic.
    schemas: BTreeMap<String, String>,
}

impl Viewer {
    /// Connects and subscribes to every topic.
    fn subscribe(address: SocketAddr, subprotocol: &str) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let request = handshake(address, subprotocol);
        let (socket, answer) = tungstenite::client(request, stream).unwrap();
        assert_eq!(answer.headers()["Sec-WebSocket-Protocol"], subprotocol);
        let mut viewer = Self { socket, topics: BTreeMap::new(), schemas: BTreeMap::new() };
        while viewer.topics.len() < 8 {
            viewer.subscribe_to_advertised();
        }
        viewer
    }

    /// Reads a message and subscribes to the topics that it offers.
    fn subscribe_to_advertised(&mut self) {
        let Message::Text(text) = self.socket.read().unwrap() else { return };
        let message: Value = serde_json::from_str(&text).unwrap();
        if message["op"] != "advertise" {
            return;
        }
        let mut subscriptions = Vec::new();
        for channel in message["channels"].as_array().unwrap() {
            let (id, topic) = (channel["id"].as_u64().unwrap(), channel["topic"].as_str().unwrap());
            let number = 100 + self.topics.len() as u32;
            self.topics.insert(number, topic.to_owned());
            let schema = channel["schemaName"].as_str().unwrap();
            self.schemas.insert(topic.to_owned(), schema.to_owned());
            subscriptions.push(json!({"id": number, "channelId": id}));
        }
        let request = json!({"op": "subscribe", "subscriptions": subscriptions});
        self.socket.send(Message::text(request.to_string())).unwrap();
    }

    /// Returns the topic, the time stamp and the content of the next message of a topic; `None`
    /// once the server has closed the connection.
    fn next(&mut self) -> Option<(String, u64, Vec<u8>)> {
        loop {
            match self.socket.read() {
                // A byte 1, the subscription, the time stamp, the content.
                Ok(Message::Binary(bytes)) if bytes.first() == Some(&1) => {
                    let number = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
                    let stamp = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                    return Some((self.topics[&number].clone(), stamp, bytes[13..].to_vec()));
                }
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(_) => {}
            }
        }
    }
}

#[test]
fn a_viewer_that_subscribes_receives_pictures_and_telemetry() {
    for subprotocol in SUBPROTOCOLS {
        receives_pictures_and_telemetry(subprotocol);
    }
}

fn receives_pictures_and_telemetry(subprotocol: &str) {
    let (mut output, address) = server();
    let mut viewer = Viewer::subscribe(address, subprotocol);
    for (topic, schema) in [
        ("/camera/image", "foxglove.CompressedImage"),
        ("/camera/calibration", "foxglove.CameraCalibration"),
        ("/tf", "foxglove.FrameTransform"),
        ("/scene", "foxglove.SceneUpdate"),
        ("/ball/observation", "plumb.Observation"),
        ("/board/telemetry", "plumb.Telemetry"),
        ("/run/events", "plumb.Event"),
        ("/run/summary", "plumb.Summary"),
    ] {
        assert_eq!(viewer.schemas[topic], schema);
    }
    let reader = thread::spawn(move || {
        let mut seen: BTreeMap<String, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
        while let Some((topic, stamp, content)) = viewer.next() {
            seen.entry(topic).or_default().push((stamp, content));
        }
        seen
    });
    let mut positions = Positions::default();
    let summary = drive(vec![&mut output, &mut positions]);
    drop(output);
    let seen = reader.join().unwrap();

    assert!(summary.reached);
    let topics: BTreeSet<&str> = seen.keys().map(String::as_str).collect();
    for topic in ["/camera/image", "/camera/calibration", "/tf", "/scene"] {
        assert!(topics.contains(topic), "{topics:?}");
    }
    for (_, image) in &seen["/camera/image"] {
        assert!(image.windows(3).any(|bytes| bytes == b"\xff\xd8\xff"), "a JPEG");
    }
    let json = |content: &[u8]| serde_json::from_slice::<Value>(content).unwrap();
    let first = &seen["/ball/observation"][0];
    for (stamp, content) in &seen["/ball/observation"] {
        let got = json(content);
        let expected = positions.0[got["frame"].as_u64().unwrap() as usize];
        let position: Option<[f64; 3]> = serde_json::from_value(got["position_m"].clone()).unwrap();
        // Records have micrometres.
        let rounded = expected.map(|at| at.coords.map(|x| (x * 1e6).round() / 1e6).into());
        assert_eq!(position, rounded, "{got}");
        let run = got["time_s"].as_f64().unwrap() - json(&first.1)["time_s"].as_f64().unwrap();
        assert!(((stamp - first.0) as f64 / 1e9 - run).abs() < 1e-6);
    }
    let telemetry = json(&seen["/board/telemetry"][0].1);
    assert!(telemetry["motors_steps"].as_array().unwrap().len() == 3, "{telemetry}");
}

/// Measured positions by frame.
#[derive(Default)]
struct Positions(Vec<Option<Point3<f64>>>);

impl Observer for Positions {
    fn frame(&mut self, record: &FrameRecord) {
        self.0.push(record.position());
    }
}

/// What must not change: every position and every report of the board.
#[derive(Default, PartialEq, Debug)]
struct Trace(Vec<(f64, Option<Point3<f64>>, Option<BoardReport>)>);

impl Observer for Trace {
    fn frame(&mut self, record: &FrameRecord) {
        self.0.push((record.time, record.position(), record.board));
    }
}

#[test]
fn viewers_that_never_read_change_no_bit_of_a_run() {
    let mut alone = Trace::default();
    let expected = drive(vec![&mut alone]);

    let (output, address) = server();
    // They subscribe to everything and read nothing more: what is sent to them fills their sockets.
    let dead: Vec<Viewer> = (0..3).map(|_| Viewer::subscribe(address, SUBPROTOCOLS[0])).collect();
    let (name, overflow) = ("output for viewers", Overflow::Block);
    let queue = QueueSettings { name, capacity: 30, overflow, with_frames: true };
    let mut output = BoundedObserver::new(output, queue).unwrap();
    let mut trace = Trace::default();
    let summary = drive(vec![&mut output, &mut trace]);
    // The end of the server does not wait for them.
    output.close().unwrap();
    drop(dead);
    assert_eq!(summary, expected);
    assert_eq!(trace, alone);
}

/// docs/SECURITY.md says what a page of another site can do here.
#[test]
fn only_a_viewer_is_answered_and_it_can_only_look() {
    let (_output, address) = server();
    let connect = || {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    };
    // What a form sends.
    let mut stream = connect();
    write!(stream, "POST / HTTP/1.1\r\nHost: {address}\r\nContent-Length: 2\r\n\r\nhi").unwrap();
    let mut reply = Vec::new();
    let _reset = stream.read_to_end(&mut reply);
    assert!(!String::from_utf8_lossy(&reply).contains(" 101 "), "{reply:?}");
    // A WebSocket of anybody.
    let plain = format!("ws://{address}/").into_client_request().unwrap();
    assert!(tungstenite::client(plain, connect()).is_err());
    // The crate looks at no origin: a page of another site can be a viewer. It may do nothing.
    let mut request = handshake(address, SUBPROTOCOLS[0]);
    request.headers_mut().insert("Origin", "http://stranger.example".parse().unwrap());
    let (mut socket, _) = tungstenite::client(request, connect()).unwrap();
    let info: Value = serde_json::from_str(socket.read().unwrap().to_text().unwrap()).unwrap();
    assert_eq!((&info["op"], &info["capabilities"]), (&json!("serverInfo"), &json!([])), "{info}");
}

#[test]
fn a_port_in_use_and_a_file_that_exists_are_refused() {
    let (rig, camera) = (rig(), camera_file::paper().unwrap());
    let (_taken, address) = server();
    let settings = FoxgloveSettings { mcap: None, server: Some(address) };
    let refused = FoxgloveOutput::start(&settings, &rig, &camera).err().unwrap();
    assert!(matches!(refused, FoxgloveError::Listen { .. }), "{refused}");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, "precious").unwrap();
    let settings = FoxgloveSettings { mcap: Some(path.clone()), server: None };
    let refused = FoxgloveOutput::start(&settings, &rig, &camera).err().unwrap();
    assert!(matches!(refused, FoxgloveError::Exists(_)), "{refused}");
    assert_eq!(std::fs::read_to_string(path).unwrap(), "precious");
}
