use std::io::{BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::{fs, thread};

use plumb_config::error_chain::ErrorChain;
use plumb_frame::image::{ColourImage, DepthImage, Image};
use plumb_pictures::{jpeg, png};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::*;

/// Longest wait for another thread: a test that reaches it fails.
const LONG: Duration = Duration::from_secs(60);

const WIDTH: usize = 8;
const HEIGHT: usize = 6;

const INTRINSICS: Intrinsics =
    Intrinsics { fx: 10.0, fy: 10.0, cx: 3.5, cy: 2.5, depth_scale: 5000.0, distortion: None };

/// Folder with the socket of a stream.
struct Socket(TempDir);

impl Socket {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("camera.sock")
    }

    fn address(&self) -> StreamAddress {
        StreamAddress::Unix(self.path())
    }

    /// Returns a sender, which waits until the stream is open.
    fn connect(&self) -> UnixStream {
        let begin = Instant::now();
        loop {
            match UnixStream::connect(self.path()) {
                Ok(stream) => return stream,
                Err(error) => assert!(begin.elapsed() < LONG, "{error}"),
            }
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Opens the stream with a sender that has sent `bytes`.
    fn open_with(&self, bytes: Vec<u8>) -> (Result<StreamSource, String>, UnixStream) {
        thread::scope(|scope| {
            let sender = scope.spawn(move || {
                let mut sender = self.connect();
                sender.write_all(&bytes).unwrap();
                sender
            });
            let source = StreamSource::open(&self.address(), INTRINSICS, LONG);
            let source = source.map_err(|error| ErrorChain(&*error).to_string());
            (source, sender.join().unwrap())
        })
    }

    /// Opens the stream with a sender that has sent the frame at 0 s.
    fn open(&self) -> (StreamSource, UnixStream) {
        let (source, sender) = self.open_with(frame(0.0));
        let mut source = source.unwrap();
        source.next_frame().unwrap().unwrap();
        (source, sender)
    }
}

fn colour() -> ColourImage {
    Image::from_fn(WIDTH, HEIGHT, |column, row| [column as u8, row as u8, 200])
}

fn depth() -> DepthImage {
    Image::from_fn(WIDTH, HEIGHT, |column, row| (1000 + 300 * row + column) as u16)
}

/// Returns a frame with these changes of its header.
fn encoded(changes: Value, colour: &[u8], depth: &[u8]) -> Vec<u8> {
    let mut header = json!({
        "t": 0.0, "width": WIDTH, "height": HEIGHT, "colour": "bgr8", "colour_bytes": colour.len(),
        "depth": "z16", "depth_bytes": depth.len(), "depth_scale": 1000.0,
    });
    for (key, value) in changes.as_object().unwrap() {
        header[key] = value.clone();
    }
    [format!("{header}\n").as_bytes(), colour, depth].concat()
}

/// Returns the bytes of a depth picture as z16.
fn z16() -> Vec<u8> {
    depth().pixels().iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Returns a frame with the time stamp `t`, seconds.
fn frame(t: f64) -> Vec<u8> {
    encoded(json!({ "t": t }), colour().channels(), &z16())
}

/// Returns the reason of the next loss.
fn loss(source: &mut StreamSource) -> String {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        match source.next_frame() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("the stream is over"),
            Err(error) if ErrorChain(&error).to_string().contains("no frame for") => {}
            Err(error) => {
                assert!(!error.is_over(), "{error}");
                return ErrorChain(&error).to_string();
            }
        }
    }
    panic!("nothing is lost")
}

/// Returns the next frame that is no loss.
fn frame_after_losses(source: &mut StreamSource) -> RgbdFrame {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        if let Ok(frame) = source.next_frame() {
            return frame.unwrap();
        }
    }
    panic!("no frame comes")
}

/// Returns the line that a sender gets when it is refused.
fn refusal(sender: UnixStream) -> String {
    let mut line = String::new();
    BufReader::new(sender).read_line(&mut line).unwrap();
    let answer: Value = serde_json::from_str(&line).unwrap();
    answer["error"].as_str().unwrap().to_owned()
}

#[test]
fn every_encoding_gives_the_picture_that_was_sent() {
    let rgb: Vec<u8> = colour().pixels().iter().flat_map(|&[b, g, r]| [r, g, b]).collect();
    let png = png::encode_colour(&colour()).unwrap();
    let png16 = png::encode_depth(&depth()).unwrap();
    let unknown = png::encode_depth(&Image::filled(WIDTH, HEIGHT, u16::MAX)).unwrap();
    let no_depth = || Image::filled(WIDTH, HEIGHT, 0);
    let frames = [
        (encoded(json!({}), colour().channels(), &z16()), depth()),
        (encoded(json!({ "colour": "rgb8" }), &rgb, &z16()), depth()),
        (encoded(json!({ "colour": "png", "depth": "png16" }), &png, &png16), depth()),
        // 65535 is no depth, as in ROS 2.
        (encoded(json!({}), colour().channels(), &[0xff; 96]), no_depth()),
        (encoded(json!({ "depth": "png16" }), colour().channels(), &unknown), no_depth()),
    ];
    for (bytes, depth) in frames {
        let socket = Socket::new();
        let (source, _sender) = socket.open_with(bytes);
        let frame = source.unwrap().next_frame().unwrap().unwrap();
        assert_eq!((frame.colour(), frame.depth()), (&colour(), &depth));
        assert_eq!(frame.intrinsics(), &Intrinsics { depth_scale: 1000.0, ..INTRINSICS });
    }
}

#[test]
fn a_stream_without_depth_is_a_camera_without_depth() {
    let grey = Image::filled(WIDTH, HEIGHT, [90, 90, 90]);
    let bytes = jpeg::encode(&grey, 95).unwrap();
    // Whatever the camera file and the header say of the depth scale.
    for scale in [json!(null), json!(1000.0)] {
        let (source, _sender) = Socket::new().open_with(encoded(
            json!({ "colour": "jpeg", "depth": "none", "depth_scale": scale }),
            &bytes,
            &[],
        ));
        let frame = source.unwrap().next_frame().unwrap().unwrap();
        assert!(frame.colour().channels().iter().all(|value| value.abs_diff(90) < 3));
        assert_eq!(frame.depth(), &Image::filled(8, 6, 0));
        assert_eq!(frame.intrinsics(), &Intrinsics { depth_scale: 0.0, ..INTRINSICS });
    }
}

#[test]
fn frames_over_tcp_arrive_too() {
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let sender = thread::spawn(move || {
        let begin = Instant::now();
        while begin.elapsed() < LONG {
            if let Ok(mut sender) = std::net::TcpStream::connect(port) {
                sender.write_all(&frame(0.0)).unwrap();
                return sender;
            }
            thread::sleep(Duration::from_millis(1));
        }
        panic!("nothing listens");
    });
    let mut source = StreamSource::open(&StreamAddress::Tcp(port), INTRINSICS, LONG).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().colour(), &colour());
    drop(sender.join().unwrap());
}

#[test]
fn a_sender_never_waits_for_the_reader_and_the_newest_frame_wins() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    // 4 MB, more than a socket's buffer. Nobody takes a frame. The time stamps run faster than any
    // computer sends, so that no frame is late.
    let count = 10_000_u32;
    for number in 1..=count {
        sender.write_all(&frame(f64::from(number) * 0.5)).unwrap();
    }
    drop(sender);
    let (mut taken, mut newest) = (0, f64::NEG_INFINITY);
    let ended = loop {
        match source.next_frame() {
            Ok(frame) => {
                let time = frame.unwrap().time();
                assert!(time > newest, "{time} after {newest}");
                (taken, newest) = (taken + 1, time);
            }
            Err(error) => break ErrorChain(&error).to_string(),
        }
    };
    assert!(ended.contains("disconnected"), "{ended}");
    assert_eq!(taken + source.skipped(), u64::from(count));
}

#[test]
fn a_malformed_header_ends_the_connection_with_the_reason() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    let huge = encoded(json!({ "t": 0.1, "colour_bytes": 4_000_000_000_u64 }), &[], &[]);
    sender.write_all(&huge).unwrap();
    let reason = loss(&mut source);
    assert!(reason.contains("the header of frame 2") && reason.contains("4000000000"), "{reason}");
    assert!(refusal(sender).contains("4000000000"));
    // Further senders are welcome.
    for (bytes, expected) in [
        (vec![b'{'; 4097], "at most 4096 bytes"),
        (b"{no JSON\n".to_vec(), "not as documented"),
        (b"{\xff\xfe\n".to_vec(), "not UTF-8"),
    ] {
        let mut sender = socket.connect();
        sender.write_all(&bytes).unwrap();
        let reason = loss(&mut source);
        assert!(reason.contains("frame 1") && reason.contains(expected), "{reason}");
        assert!(refusal(sender).contains(expected));
    }
    let mut sender = socket.connect();
    sender.write_all(&frame(7.0)).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().depth(), &depth());
}

#[test]
fn a_header_without_end_is_refused_before_it_fills_the_memory() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    let written = thread::spawn(move || (0..).find(|_| sender.write_all(&[b' '; 4096]).is_err()));
    let reason = loss(&mut source);
    assert!(reason.contains("at most 4096 bytes"), "{reason}");
    // The connection is closed, so that the sender gets an error.
    assert!(written.join().unwrap().is_some());
}

#[test]
fn a_sender_that_ends_or_stops_within_a_frame_is_a_loss() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    sender.write_all(&frame(0.1)[..200]).unwrap();
    drop(sender);
    assert!(loss(&mut source).contains("ended in the middle of frame 2"));
    let mut sender = socket.connect();
    sender.write_all(b"{\"t\": 0.2").unwrap();
    sender.shutdown(Shutdown::Write).unwrap();
    assert!(loss(&mut source).contains("ended in the middle of frame 1"));
    // This one stays connected.
    let mut sender = socket.connect();
    sender.write_all(&frame(0.3)[..200]).unwrap();
    let reason = loss(&mut source);
    assert!(reason.contains("stopped for 2 s in the middle of frame 1"), "{reason}");
    assert!(refusal(sender).contains("stopped for 2 s"));
}

#[test]
fn a_second_sender_is_refused_and_a_later_one_is_not() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    let second = socket.connect();
    sender.write_all(&frame(0.1)).unwrap();
    assert!(refusal(second).contains("another sender is connected"));
    source.next_frame().unwrap().unwrap();
    drop(sender);
    assert!(loss(&mut source).contains("disconnected"));
    // Its clock may be another one.
    socket.connect().write_all(&frame(-500.0)).unwrap();
    source.next_frame().unwrap().unwrap();
}

/// Returns bytes of strangers, each with a good frame behind them.
fn strangers() -> [Vec<u8>; 4] {
    let post = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    let handshake = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03";
    [&post[..], handshake, b"\n", b"\0"].map(|bytes| [bytes, &frame(0.5)].concat())
}

#[test]
fn a_stranger_is_ended_by_name_and_shows_no_picture() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    // The camera is connected, and may be silent for long.
    for (bytes, t) in strangers().into_iter().zip([0.1, 0.2, 0.3, 0.4]) {
        let mut stranger = socket.connect();
        let _ended = stranger.write_all(&bytes);
        let refusal = refusal(stranger);
        assert!(
            ["another sender is connected", "begins with"].iter().any(|it| refusal.contains(it))
        );
        sender.write_all(&frame(t)).unwrap();
        source.next_frame().unwrap().unwrap();
    }
    drop(sender);
    assert!(loss(&mut source).contains("disconnected"));
    // The camera is not.
    for bytes in strangers() {
        let mut stranger = socket.connect();
        let _ended = stranger.write_all(&bytes);
        let reason = loss(&mut source);
        assert!(reason.contains("first line is no header of a frame"), "{reason}");
        assert!(reason.contains("a browser or another program?"), "{reason}");
        assert!(refusal(stranger).contains("first line is no header of a frame"));
    }
    let mut sender = socket.connect();
    sender.write_all(&frame(7.0)).unwrap();
    source.next_frame().unwrap().unwrap();
}

#[test]
fn a_stranger_before_the_camera_does_not_end_the_wait() {
    let socket = Socket::new();
    let (source, _sender) = thread::scope(|scope| {
        let sender = scope.spawn(|| {
            for bytes in strangers() {
                let mut stranger = socket.connect();
                let _ended = stranger.write_all(&bytes);
                assert!(refusal(stranger).contains("first line is no header of a frame"));
            }
            let mut sender = socket.connect();
            sender.write_all(&frame(0.0)).unwrap();
            sender
        });
        let source = StreamSource::open(&socket.address(), INTRINSICS, LONG);
        (source, sender.join().unwrap())
    });
    source.unwrap().next_frame().unwrap().unwrap();
    // Without a camera the error names the last one.
    let socket = Socket::new();
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut stranger = socket.connect();
            let _ended = stranger.write_all(b"GET /index.html HTTP/1.1\r\n\r\n");
            refusal(stranger)
        });
        let limit = Duration::from_secs(1);
        let error = StreamSource::open(&socket.address(), INTRINSICS, limit).unwrap_err();
        let error = ErrorChain(&*error).to_string();
        assert!(error.contains("it begins with \"GET /index.html HTTP/1.1\""), "{error}");
    });
}

#[test]
fn a_camera_that_reconnects_replaces_its_dead_connection() {
    let socket = Socket::new();
    let (mut source, mut silent) = socket.open();
    silent.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let (begin, mut answer) = (Instant::now(), String::new());
    let mut next = None;
    while silent.read_to_string(&mut answer).is_err() {
        assert!(begin.elapsed() < LONG, "the silent camera does not give way");
        drop(next.take());
        // One that is refused may have gone.
        let mut sender = socket.connect();
        let _refused = sender.write_all(&frame(7.0));
        next = Some(sender);
    }
    assert!(answer.contains("nothing for 2 s"), "{answer}");
    assert!(loss(&mut source).contains("nothing for 2 s"));
    frame_after_losses(&mut source);
    next.unwrap().write_all(&frame(7.1)).unwrap();
    frame_after_losses(&mut source);
}

#[test]
fn a_frame_of_another_format_is_lost_and_the_next_one_is_not() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    let small = encoded(json!({ "t": 0.1, "width": 4 }), &[0; 72], &[0; 48]);
    let scale = encoded(json!({ "t": 0.2, "depth_scale": 5000.0 }), colour().channels(), &z16());
    let png = png::encode_colour(&Image::filled(6, 8, [0; 3])).unwrap();
    let turned = encoded(json!({ "t": 0.3, "colour": "png" }), &png, &z16());
    let damaged = encoded(json!({ "t": 0.4, "colour": "jpeg" }), b"no picture", &z16());
    for (bytes, expected) in [
        (small, "a frame of 4x6, but the first one was 8x6"),
        (scale, "`depth_scale` is 5000, but was 1000"),
        (turned, "a picture of 6x8, but it must be 8x6"),
        (damaged, "the colour picture cannot be decoded: not a picture"),
        (frame(0.4), "key `t`: the time stamp 0.4 s is not after the one before, 0.4 s"),
    ] {
        sender.write_all(&bytes).unwrap();
        let reason = loss(&mut source);
        assert!(reason.contains(expected), "{reason}");
    }
    sender.write_all(&frame(0.5)).unwrap();
    source.next_frame().unwrap().unwrap();
}

#[test]
fn a_stream_without_a_good_first_frame_is_not_opened() {
    let socket = Socket::new();
    let limit = Duration::from_millis(20);
    let error = StreamSource::open(&socket.address(), INTRINSICS, limit).unwrap_err().to_string();
    assert!(error.contains("no frame came within 0 s; start the program"), "{error}");
    let (source, _sender) = socket.open_with(b"{}\n".to_vec());
    assert!(source.unwrap_err().contains("missing field"));
    let large =
        encoded(json!({ "width": 32, "height": 32, "depth": "none" }), &[0; 3 * 32 * 32], &[]);
    let (source, _sender) = socket.open_with(large);
    let error = source.unwrap_err();
    assert!(error.contains("32x32") && error.contains("another resolution"), "{error}");
}

#[test]
fn a_silent_sender_is_an_error_that_does_not_end_the_stream() {
    let socket = Socket::new();
    let (mut source, mut sender) = socket.open();
    let error = source.next_frame().unwrap_err();
    assert!(!error.is_over() && ErrorChain(&error).to_string().contains("no frame for"), "{error}");
    sender.write_all(&frame(0.1)).unwrap();
    source.next_frame().unwrap().unwrap();
}

#[test]
fn a_socket_is_for_its_user_only() {
    let socket = Socket::new();
    let (_source, _sender) = socket.open();
    let mode = fs::symlink_metadata(socket.path()).unwrap().permissions().mode();
    assert_eq!(mode & 0o7777, 0o600, "{mode:o}");
}

#[test]
fn a_socket_is_removed_replaced_where_left_behind_and_never_stolen() {
    let socket = Socket::new();
    drop(UnixListener::bind(socket.path()).unwrap());
    assert!(socket.path().exists());
    let (source, sender) = socket.open();
    let open = || StreamSource::open(&socket.address(), INTRINSICS, LONG);
    let error = open().unwrap_err().to_string();
    assert!(error.contains("another program listens there"), "{error}");
    drop((source, sender));
    assert!(!socket.path().exists());
    fs::write(socket.path(), "a file").unwrap();
    let error = ErrorChain(&*open().unwrap_err()).to_string();
    assert!(error.contains("is no socket"), "{error}");
    assert_eq!(fs::read(socket.path()).unwrap(), b"a file");
    let nowhere = StreamAddress::Unix(Path::new("no/such/folder/a.sock").to_owned());
    let error = StreamSource::open(&nowhere, INTRINSICS, LONG).unwrap_err().to_string();
    assert!(error.contains("no/such/folder/a.sock: cannot listen"), "{error}");
}

#[test]
fn dropping_the_source_disconnects_the_sender() {
    let socket = Socket::new();
    let (source, mut sender) = socket.open();
    drop(source);
    assert_eq!(sender.read(&mut [0; 1]).unwrap(), 0);
}
