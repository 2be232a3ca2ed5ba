use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::super::{Arrivals, LeftOut, TargetReceiver, TargetSource, target_channel};
use super::*;

/// Longest wait for another thread: a test that reaches it fails.
const LONG: Duration = Duration::from_secs(60);

/// Line of a target.
const GOOD: &str = "{\"target\": [0.4, 0.3, 0.2]}\n";

/// Returns a stream at a Unix socket, which is in the folder, and what it sends.
fn unix_stream() -> (TempDir, PathBuf, TargetStream, TargetReceiver) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.sock");
    let (sender, receiver) = target_channel();
    let address = format!("unix:{}", path.display()).parse().unwrap();
    let stream = TargetStream::start(TargetOrigin::Program(address), sender).unwrap();
    (folder, path, stream, receiver)
}

/// Returns a free TCP port of this computer.
fn free_port() -> SocketAddr {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

/// Sends `bytes` as all that a sender has. Returns what it receives until its connection ends.
fn send_all(mut program: impl Read + Write, bytes: &[u8], end: impl Fn(Shutdown)) -> String {
    // A connection that has ended takes no more.
    let _ended = program.write_all(bytes);
    end(Shutdown::Write);
    let mut answer = Vec::new();
    // Bytes that were not read reset the connection after the answer.
    let _reset = program.read_to_end(&mut answer);
    String::from_utf8(answer).unwrap()
}

/// Sends `bytes` through a Unix socket, as [`send_all`].
fn send_unix(path: &Path, bytes: &[u8]) -> String {
    let program = UnixStream::connect(path).unwrap();
    program.set_read_timeout(Some(LONG)).unwrap();
    send_all(&program, bytes, |side| drop(program.shutdown(side)))
}

/// Takes what comes until `done` or the end.
fn take_until(receiver: &mut TargetReceiver, done: impl Fn(&Arrivals) -> bool) -> Arrivals {
    let (begin, mut all) = (Instant::now(), Arrivals::default());
    loop {
        assert!(begin.elapsed() < LONG, "{all:?}");
        let Arrivals { targets, problems, left_out, end } = receiver.take(0.0);
        all.targets.extend(targets);
        all.problems.extend(problems);
        (all.left_out, all.end) = (left_out, end);
        if done(&all) || end.is_some() {
            return all;
        }
        thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn bad_lines_are_told_with_their_number_and_the_good_ones_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("targets.sock");
    let address = format!("unix:{}", path.display()).parse().unwrap();
    let (sender, mut receiver) = target_channel();
    let stream = TargetStream::start(TargetOrigin::Program(address), sender).unwrap();
    let mut program = UnixStream::connect(&path).unwrap();
    let long = "x".repeat(100_000);
    let text = format!(
        "{{\"target\": [0.4, 0.3, 0.2]}}\nhere\n{long}\n\n{{\"target\": [0.4, 0.3, 0.3]}}\n"
    );
    program.write_all(text.as_bytes()).unwrap();
    program.write_all(b"\xff\xfe\n{\"target\": [0.4, 0.3, 0.4], \"velocity\": [0, 0, 1]}").unwrap();
    drop(program);
    let Arrivals { targets, problems, left_out, .. } =
        take_until(&mut receiver, |all| all.targets.len() == 3);
    let heights: Vec<f64> = targets.iter().map(|target| target.position.z).collect();
    assert_eq!(heights, [0.2, 0.3, 0.4]);
    assert_eq!(left_out, LeftOut { unreadable: 3, ..LeftOut::default() });
    let expected = ["line 2: no target", "line 3: is too long", "line 6: is not UTF-8 text"];
    for (problem, begin) in problems.iter().zip(expected) {
        assert!(problem.starts_with(begin), "{problem}");
    }
    // Another sender may connect; its lines are counted from 1, and the motion is the same.
    let mut program = UnixStream::connect(&path).unwrap();
    program.write_all(b"{\"t\": 7, \"target\": [0.4, 0.3, 0.5]}\nthere\n").unwrap();
    let next = take_until(&mut receiver, |all| all.problems.len() == 1);
    assert!(next.problems[0].starts_with("line 2: no target"), "{:?}", next.problems);
    assert_eq!(next.targets[0].motion, targets[0].motion);
    drop(stream);
    assert_eq!(receiver.take(0.0).end, Some(SourceEnd::Complete));
    assert!(!path.exists());
}

#[test]
fn a_file_is_played_by_its_times_to_its_end() {
    let line = TargetLine::parse("{\"target\": [0.4, 0.3, 0.2]}").unwrap();
    let targets = [0.0, 0.02].map(|time_s| FileTarget { time_s, line });
    let (sender, mut receiver) = target_channel();
    let _stream = TargetStream::start(TargetOrigin::File(targets.to_vec()), sender).unwrap();
    let all = take_until(&mut receiver, |_| false);
    assert_eq!((all.targets.len(), all.end), (2, Some(SourceEnd::Complete)));
    assert_eq!(all.problems, [""; 0]);
}

/// Beginnings of senders that are strangers, each with good lines behind it.
fn strangers() -> Vec<Vec<u8>> {
    let body = GOOD.repeat(3);
    let length = body.len();
    let post = format!(
        "POST / HTTP/1.1\r\nHost: 127.0.0.1:5601\r\nContent-Length: {length}\r\n\
         Content-Type: text/plain;charset=UTF-8\r\nOrigin: http://stranger.example\r\n\r\n"
    );
    let socket = "GET /{} HTTP/1.1\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\r\n";
    let first_lines: [&[u8]; 15] = [
        post.as_bytes(),
        socket.as_bytes(),
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\n",
        b"\x00\x03\x00\x58\x21\x12\xa4\x42\n",
        b"hello, this is a tracker\n",
        b"\n",
        b" \r\n",
        b"\0",
        b"\0\n",
        b"\xff\xfe\n",
        "\u{feff}".as_bytes(),
        b"{\n",
        b"{\"target\": [0.4, 0.3]}\n",
        b"{\"target\": [400, 300, 200]}\n",
    ];
    let mut all: Vec<Vec<u8>> = first_lines.iter().map(|line| line.to_vec()).collect();
    all.push([b"x".repeat(1 << 20), b"\n".to_vec()].concat());
    all.push([b"{".to_vec(), b" ".repeat(5000), b"\n".to_vec()].concat());
    all.into_iter().map(|beginning| [beginning, body.clone().into_bytes()].concat()).collect()
}

#[test]
fn on_a_socket_the_first_line_is_a_target_or_no_line_counts() {
    let (_folder, path, _stream, mut receiver) = unix_stream();
    let strangers = strangers();
    for (k, bytes) in (1..).zip(&strangers) {
        let beginning = String::from_utf8_lossy(&bytes[..20]).into_owned();
        let answer = send_unix(&path, bytes);
        let all = take_until(&mut receiver, |_| true);
        assert_eq!(all.targets, [], "{beginning:?}");
        assert_eq!(all.left_out, LeftOut { unreadable: k, ..LeftOut::default() }, "{beginning:?}");
        // The first ten are told.
        for problem in &all.problems {
            assert!(problem.contains("its first line is no target"), "{beginning:?}: {problem}");
            assert!(problem.contains("a browser or another program?"), "{beginning:?}: {problem}");
        }
        assert_eq!(all.problems.len(), usize::from(k <= 10), "{beginning:?}");
        assert!(answer.is_empty() || answer.starts_with("{\"error\":"), "{answer}");
    }
    // A sender that begins with a target is welcome after them.
    assert_eq!(send_unix(&path, GOOD.as_bytes()), "");
    assert_eq!(take_until(&mut receiver, |all| all.targets.len() == 1).targets.len(), 1);
}

#[test]
fn a_stranger_at_a_tcp_port_is_ended_by_name() {
    let port = free_port();
    let (sender, mut receiver) = target_channel();
    let address = format!("tcp:{port}").parse().unwrap();
    let _stream = TargetStream::start(TargetOrigin::Program(address), sender).unwrap();
    let program = TcpStream::connect(port).unwrap();
    program.set_read_timeout(Some(LONG)).unwrap();
    let bytes = format!("POST /secret HTTP/1.1\r\nHost: {port}\r\n\r\n{GOOD}{GOOD}");
    let answer = send_all(&program, bytes.as_bytes(), |side| drop(program.shutdown(side)));
    let all = take_until(&mut receiver, |all| !all.problems.is_empty());
    assert_eq!(all.targets, []);
    assert!(all.problems[0].contains("\"POST /secret HTTP/1.1\""), "{:?}", all.problems);
    assert!(answer.contains("its first line is no target"), "{answer}");
}

#[test]
fn ten_unreadable_lines_in_a_row_end_a_sender_by_name() {
    let (_folder, path, _stream, mut receiver) = unix_stream();
    // Nine do not, and an empty line is none.
    let (nine, ten) = ("no target\n".repeat(9), "{}\n\n".repeat(10));
    let text = format!("{GOOD}{nine}{GOOD}{nine}\n{GOOD}{ten}{GOOD}");
    let answer = send_unix(&path, text.as_bytes());
    assert!(answer.contains("ten unreadable lines in a row"), "{answer}");
    let all = take_until(&mut receiver, |_| true);
    assert_eq!((all.targets.len(), all.left_out.unreadable), (3, 28));
    // A run tells the first ten problems.
    let text = format!("{GOOD}{ten}{GOOD}");
    let (_folder, path, _stream, mut receiver) = unix_stream();
    send_unix(&path, text.as_bytes());
    let all = take_until(&mut receiver, |_| true);
    assert!(all.problems[9].contains("ten unreadable lines in a row"), "{:?}", all.problems);
    assert_eq!(all.targets.len(), 1);
}

#[test]
fn a_line_without_an_end_ends_its_sender() {
    let (_folder, path, _stream, mut receiver) = unix_stream();
    let mut program = UnixStream::connect(&path).unwrap();
    program.set_read_timeout(Some(LONG)).unwrap();
    program.write_all(GOOD.as_bytes()).unwrap();
    let mut written = 0_u64;
    while written < 1 << 28 && program.write_all(&[b'x'; 1 << 16]).is_ok() {
        written += 1 << 16;
    }
    assert!(written < 1 << 28, "the sender goes on for ever");
    let all = take_until(&mut receiver, |all| !all.problems.is_empty());
    assert_eq!((all.targets.len(), all.left_out.unreadable), (1, 1));
    assert!(all.problems[0].contains("a line without an end"), "{:?}", all.problems);
}

#[test]
fn a_sender_that_is_silent_gives_way_and_a_live_one_does_not() {
    let (_folder, path, _stream, mut receiver) = unix_stream();
    let mut silent = UnixStream::connect(&path).unwrap();
    silent.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    silent.write_all(GOOD.as_bytes()).unwrap();
    take_until(&mut receiver, |all| !all.targets.is_empty());
    // The sender connects anew while its dead connection is open. A stranger connects, too.
    let (begin, mut answer) = (Instant::now(), String::new());
    let mut next = None;
    while silent.read_to_string(&mut answer).is_err() {
        assert!(begin.elapsed() < LONG, "the silent sender does not give way");
        drop(next.take());
        send_unix(&path, b"GET / HTTP/1.1\r\n\r\n");
        // One that is refused may have gone.
        let mut sender = UnixStream::connect(&path).unwrap();
        let _refused = sender.write_all(GOOD.as_bytes());
        next = Some(sender);
    }
    assert!(answer.contains("nothing for 2 s"), "{answer}");
    let all = take_until(&mut receiver, |all| !all.targets.is_empty());
    assert!(all.problems[0].contains("nothing for 2 s"), "{:?}", all.problems);
    // The new one is alive.
    let mut next = next.unwrap();
    for _ in 0..10 {
        let other = UnixStream::connect(&path).unwrap();
        next.write_all(GOOD.as_bytes()).unwrap();
        let answer = send_all(&other, b"", |_| ());
        assert!(answer.contains("another sender is connected"), "{answer}");
    }
    take_until(&mut receiver, |all| all.targets.len() >= 10);
}

#[test]
fn a_sender_that_has_closed_gives_way_at_once() {
    let (_folder, path, _stream, mut receiver) = unix_stream();
    for _ in 0..100 {
        // Each one connects while the lines of the one before may wait.
        let mut program = UnixStream::connect(&path).unwrap();
        program.write_all(GOOD.repeat(100).as_bytes()).unwrap();
        drop(program);
        assert_eq!(send_unix(&path, GOOD.as_bytes()), "");
        take_until(&mut receiver, |all| all.targets.len() == 101);
    }
}
