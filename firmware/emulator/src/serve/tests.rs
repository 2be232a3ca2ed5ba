#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::time::Instant;

use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, Hello, ToBoard};

use super::*;
use crate::board::EMULATED;

/// Longest wait for something that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until `is_so` of the board.
fn until(served: &Served, is_so: impl Fn(&EmulatedBoard) -> bool) {
    let begin = Instant::now();
    while !is_so(&served.board()) {
        assert!(begin.elapsed() < PATIENCE, "it never came");
        thread::sleep(SLEEP);
    }
}

#[test]
fn a_host_that_takes_the_time_is_waited_for() {
    let served = serve(EmulatedBoard::new(EMULATED)).unwrap();
    let mut time = BoardTime::of(served.path()).unwrap().unwrap();
    let greeting = encode(&ToBoard { id: 7, command: Command::Hello(Hello::OURS) }).unwrap();
    let greeted = time.run(&mut greeting.to_vec(), Micros(0), true).unwrap().unwrap();
    let mut accumulator = Accumulator::new();
    let answer = greeted.bytes.iter().find_map(|&byte| accumulator.push::<FromBoard>(byte));
    assert!(matches!(answer, Some(Ok(FromBoard::Hello(hello))) if hello.id == 7), "{answer:?}");
    // The board's time stands until it is asked for, and never is beyond that.
    let end = Micros(greeted.now.0 + 10 * u64::from(TICK_US));
    thread::sleep(20 * SLEEP);
    assert_eq!(served.board().now(), greeted.now);
    assert_eq!(time.run(&mut Vec::new(), end, false).unwrap().unwrap().now, end);
    thread::sleep(20 * SLEEP);
    assert_eq!(served.board().now(), end);
    // It goes on without the host.
    drop(time);
    until(&served, |board| board.now() > end);
}

#[test]
fn a_fast_board_is_no_faster_than_its_host() {
    let served = serve_at(EmulatedBoard::new(EMULATED), 1000.0).unwrap();
    let mut time = BoardTime::of(served.path()).unwrap().unwrap();
    let begin = time.run(&mut Vec::new(), Micros(0), false).unwrap().unwrap().now;
    for k in 1..=100 {
        let end = Micros(begin.0 + k * 1_000_000);
        assert_eq!(time.run(&mut Vec::new(), end, false).unwrap().unwrap().now, end);
    }
}

#[test]
fn a_terminal_of_another_program_gives_no_time() {
    let terminal = Terminal::open().unwrap();
    assert!(BoardTime::of(terminal.path()).unwrap().is_none());
    assert!(BoardTime::of(Path::new("/no/terminal")).unwrap().is_none());
}
