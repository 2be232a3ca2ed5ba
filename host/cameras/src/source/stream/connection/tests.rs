use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;

use tempfile::TempDir;

use super::super::StreamAddress;
use super::*;

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

    /// Accepts the sender that connected first.
    fn accept(&self) -> Connection<'_> {
        Connection::new(self.endpoint.next_connection().unwrap().unwrap(), &self.endpoint, &is_open)
    }

    /// Accepts a sender that has begun and is silent from then on, for as long as it may be.
    fn accept_silent(&self) -> (UnixStream, Connection<'_>) {
        let sender = self.connect(b"{");
        let mut connection = self.accept();
        assert_eq!(read(&mut connection).unwrap(), b"{");
        connection.last_byte = before(SILENCE);
        (sender, connection)
    }
}

/// Returns the moment that is `passed` ago.
fn before(passed: Duration) -> Instant {
    Instant::now().checked_sub(passed).unwrap()
}

fn read(connection: &mut Connection<'_>) -> io::Result<Vec<u8>> {
    let mut buffer = [0; 64];
    connection.read(&mut buffer).map(|count| buffer[..count].to_vec())
}

/// Returns the interruption of the next read.
fn interruption(connection: &mut Connection<'_>) -> Interruption {
    let error = read(connection).unwrap_err();
    Interruption::of(&error).unwrap_or_else(|| panic!("{error}")).clone()
}

/// Returns what a sender receives until its connection ends.
fn answer(mut sender: UnixStream) -> String {
    let mut text = Vec::new();
    // Bytes that were not read reset the connection after the answer.
    let _reset = sender.read_to_end(&mut text);
    String::from_utf8(text).unwrap()
}

#[test]
fn the_first_byte_decides_whether_a_sender_is_one() {
    for (bytes, quoted) in [
        (&b"POST / HTTP/1.1\r\nHost: a\r\n\r\n{}"[..], "POST / HTTP/1.1"),
        (b"\x16\x03\x01\x02\x00{}", "\x16\x03\x01\x02\x00{}"),
        (b"\n{}", ""),
        (b" {}", " {}"),
        ("\u{feff}{}".as_bytes(), "\u{feff}{}"),
        (b"\xff{}", "\u{fffd}{}"),
        (&[b'x'; 64], &"x".repeat(64)),
    ] {
        let bench = Bench::new();
        let _sender = bench.connect(bytes);
        let stranger = interruption(&mut bench.accept());
        assert_eq!(stranger, Interruption::Stranger(quoted.to_owned()));
    }
    // Only the first one does.
    let bench = Bench::new();
    let mut sender = bench.connect(b"{");
    let mut connection = bench.accept();
    assert_eq!(read(&mut connection).unwrap(), b"{");
    sender.write_all(b"GET /").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"GET /");
}

#[test]
fn a_sender_that_is_alive_does_not_give_way() {
    let bench = Bench::new();
    let mut sender = bench.connect(b"{");
    let mut connection = bench.accept();
    // It has just connected, and its first byte waits.
    let second = bench.connect(b"{");
    assert_eq!(read(&mut connection).unwrap(), b"{");
    assert!(answer(second).contains("another sender is connected"));
    // It was silent for long, and has sent again before this is noticed.
    connection.last_byte = before(3 * SILENCE);
    let third = bench.connect(b"{");
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert!(answer(third).contains("another sender is connected"));
    assert!(bench.endpoint.kept.borrow().is_none());
}

#[test]
fn a_silent_sender_gives_way_to_one_that_begins() {
    let bench = Bench::new();
    let (_sender, mut connection) = bench.accept_silent();
    let _next = bench.connect(b"{\"t\"");
    assert_eq!(interruption(&mut connection), Interruption::GaveWay);
    drop(connection);
    // The first bytes of the next one are not lost.
    assert_eq!(read(&mut bench.accept()).unwrap(), b"{\"t\"");
}

#[test]
fn a_silent_sender_stays_where_a_stranger_connects() {
    let bench = Bench::new();
    let (mut sender, mut connection) = bench.accept_silent();
    for (bytes, reason) in [(&b"GET / HTTP/1.1\r\n"[..], "begins with"), (b"", "")] {
        let stranger = bench.connect(bytes);
        stranger.shutdown(std::net::Shutdown::Write).unwrap();
        let handles = [None, None, bench.endpoint.listener()];
        assert!(wait(&handles).unwrap()[2]);
        connection.meet_newcomer().unwrap();
        connection.judge_candidate().unwrap();
        assert!(answer(stranger).contains(reason));
    }
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
}

#[test]
fn a_candidate_is_refused_where_the_sender_goes_on() {
    let bench = Bench::new();
    let (mut sender, mut connection) = bench.accept_silent();
    let candidate = bench.connect(b"");
    connection.meet_newcomer().unwrap();
    assert!(connection.candidate.is_some());
    // A third one waits for the candidate as for the sender.
    let third = bench.connect(b"{");
    connection.meet_newcomer().unwrap();
    assert!(answer(third).contains("another sender is connected"));
    sender.write_all(b"}").unwrap();
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert!(answer(candidate).contains("another sender is connected"));
}

#[test]
fn a_silent_candidate_gives_way_too() {
    let bench = Bench::new();
    let (_sender, mut connection) = bench.accept_silent();
    let candidate = bench.connect(b"");
    connection.meet_newcomer().unwrap();
    connection.candidate.as_mut().unwrap().since = before(SILENCE);
    let _third = bench.connect(b"{3");
    assert_eq!(interruption(&mut connection), Interruption::GaveWay);
    assert!(answer(candidate).contains("nothing for 2 s"));
    drop(connection);
    assert_eq!(read(&mut bench.accept()).unwrap(), b"{3");
}

#[test]
fn a_sender_that_has_closed_gives_way_at_once() {
    let bench = Bench::new();
    let sender = bench.connect(b"{");
    let mut connection = bench.accept();
    assert_eq!(read(&mut connection).unwrap(), b"{");
    let mut last = sender;
    last.write_all(b"}").unwrap();
    drop(last);
    // Another one connects while the last byte waits.
    let _next = bench.connect(b"{\"t\"");
    assert_eq!(read(&mut connection).unwrap(), b"}");
    assert_eq!(read(&mut connection).unwrap(), b"");
    drop(connection);
    assert_eq!(read(&mut bench.accept()).unwrap(), b"{\"t\"");
}
