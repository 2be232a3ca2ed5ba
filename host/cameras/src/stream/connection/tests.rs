use std::io::Write;
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use tempfile::TempDir;

use super::*;
use crate::stream::StreamAddress;

/// Longest wait for another thread: a test that reaches it fails.
const LONG: Duration = Duration::from_secs(60);

fn is_open() -> bool {
    false
}

/// Endpoint at a Unix socket in a folder of its own.
struct Bench {
    endpoint: Endpoint,
    path: PathBuf,
    _folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stream.sock");
        let endpoint = Endpoint::listen(&StreamAddress::Unix(path.clone())).unwrap();
        Self { endpoint, path, _folder: folder }
    }

    /// Connects a sender that sends `bytes`.
    fn connect(&self, bytes: &[u8]) -> UnixStream {
        let mut sender = UnixStream::connect(&self.path).unwrap();
        sender.set_read_timeout(Some(LONG)).unwrap();
        sender.write_all(bytes).unwrap();
        sender
    }

    /// Returns the sender that has begun.
    fn sender(&self) -> Connection<'_> {
        match self.endpoint.next_arrival().unwrap() {
            Some(Arrival::Sender(file)) => Connection::new(file, &self.endpoint, &is_open),
            other => panic!("{other:?}"),
        }
    }

    /// Returns a sender that has begun and is silent from then on, for as long as it may be.
    fn silent_sender(&self) -> (UnixStream, Connection<'_>) {
        let sender = self.connect(b"{");
        let mut connection = self.sender();
        assert_eq!(read(&mut connection).unwrap(), b"{");
        connection.last_byte = Instant::now().checked_sub(SILENCE).unwrap();
        (sender, connection)
    }
}

fn read(connection: &mut Connection<'_>) -> io::Result<Vec<u8>> {
    let mut buffer = [0; 64];
    connection.read(&mut buffer).map(|count| buffer[..count].to_vec())
}

/// Returns the interruption of the next read.
fn interruption(connection: &mut Connection<'_>) -> Interruption {
    let error = read(connection).unwrap_err();
    Interruption::of(&error).unwrap_or_else(|| panic!("{error}"))
}

/// Returns what a sender receives until its connection ends.
fn answer(mut sender: UnixStream) -> String {
    let mut text = Vec::new();
    // Bytes that were not read reset the connection after the answer.
    let _reset = sender.read_to_end(&mut text);
    String::from_utf8(text).unwrap()
}

#[test]
fn the_first_byte_tells_a_sender_from_a_stranger() {
    for (bytes, quoted) in [
        (&b"POST / HTTP/1.1\r\nHost: a\r\n\r\n{}"[..], "POST / HTTP/1.1"),
        (b"\x16\x03\x01\x02\x00{}", "\\u{16}\\u{3}\\u{1}\\u{2}\\0{}"),
        (b"\n{}", ""),
        (b" {}", " {}"),
        ("\u{feff}{}".as_bytes(), "\\u{feff}{}"),
        (b"\xff{}", "\u{fffd}{}"),
    ] {
        let bench = Bench::new();
        let _sender = bench.connect(bytes);
        match bench.endpoint.next_arrival().unwrap() {
            Some(Arrival::Stranger(_, stranger)) => {
                assert_eq!(stranger.to_string(), format!("it begins with \"{quoted}\""));
            }
            other => panic!("{bytes:?}: {other:?}"),
        }
    }
    // Only the first byte does, and it stays in the connection.
    let bench = Bench::new();
    let mut sender = bench.connect(b"{");
    let mut connection = bench.sender();
    assert_eq!(read(&mut connection).unwrap(), b"{");
    sender.write_all(b"GET /").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"GET /");
}

#[test]
fn those_that_send_nothing_keep_nobody_out() {
    let bench = Bench::new();
    let idle: Vec<UnixStream> = (0..20).map(|_| bench.connect(b"")).collect();
    drop(bench.connect(b""));
    for _ in 0..3 {
        assert!(bench.endpoint.arrival().unwrap().is_none());
    }
    let _sender = bench.connect(b"{");
    assert_eq!(read(&mut bench.sender()).unwrap(), b"{");
    // The newest ones wait; the others had no room.
    let is_ended = |k: usize| answer_now(&idle[k]).contains("sends nothing");
    assert_eq!([0, 11, 14, 19].map(is_ended), [true, true, false, false]);
}

/// Returns what a sender has received so far.
fn answer_now(mut sender: &UnixStream) -> String {
    sender.set_nonblocking(true).unwrap();
    let mut bytes = [0; 200];
    let count = sender.read(&mut bytes).unwrap_or(0);
    String::from_utf8_lossy(&bytes[..count]).into_owned()
}

#[test]
fn a_sender_that_is_alive_does_not_give_way() {
    let bench = Bench::new();
    let mut sender = bench.connect(b"{");
    let mut connection = bench.sender();
    // Its first byte has not been read.
    let second = bench.connect(b"{");
    assert_eq!(read(&mut connection).unwrap(), b"{");
    assert!(answer(second).contains("another sender is connected"));
    // It was silent for long, and has sent again before this is noticed.
    connection.last_byte = Instant::now().checked_sub(3 * SILENCE).unwrap();
    let third = bench.connect(b"{");
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert!(answer(third).contains("another sender is connected"));
}

#[test]
fn a_silent_sender_gives_way_to_one_that_begins() {
    let bench = Bench::new();
    let (_sender, mut connection) = bench.silent_sender();
    let _idle = bench.connect(b"");
    let _next = bench.connect(b"{\"t\"");
    assert_eq!(interruption(&mut connection), Interruption::GaveWay);
    drop(connection);
    // The first bytes of the next one are not lost.
    assert_eq!(read(&mut bench.sender()).unwrap(), b"{\"t\"");
}

#[test]
fn a_silent_sender_stays_where_a_stranger_connects() {
    let bench = Bench::new();
    let (mut sender, mut connection) = bench.silent_sender();
    for (bytes, reason) in [(&b"GET / HTTP/1.1\r\n"[..], "begins with"), (b"", "")] {
        let stranger = bench.connect(bytes);
        stranger.shutdown(Shutdown::Write).unwrap();
        connection.look_for_another().unwrap();
        assert!(answer(stranger).contains(reason));
    }
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
}

#[test]
fn those_that_wait_are_refused_where_the_sender_goes_on() {
    let bench = Bench::new();
    let (mut sender, mut connection) = bench.silent_sender();
    let waiting = bench.connect(b"");
    connection.look_for_another().unwrap();
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert!(answer(waiting).contains("another sender is connected"));
}

#[test]
fn a_sender_that_has_closed_gives_way_at_once() {
    let bench = Bench::new();
    let mut sender = bench.connect(b"{");
    let mut connection = bench.sender();
    assert_eq!(read(&mut connection).unwrap(), b"{");
    sender.write_all(b"}").unwrap();
    drop(sender);
    // Another one connects while the last byte waits.
    let _next = bench.connect(b"{\"t\"");
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert_eq!(read(&mut connection).unwrap(), b"");
    drop(connection);
    assert_eq!(read(&mut bench.sender()).unwrap(), b"{\"t\"");
}
