//! Tests of an emulated board on a link.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::time::Duration;

use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, Hello, State, ToBoard};

use super::*;
use crate::plant::{Plant, QuasiStatic, RigError, Task};
use crate::{EMULATED, EmulatedBoard, serve};

fn milliseconds(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn to_board(id: u16, command: Command) -> Vec<u8> {
    encode(&ToBoard { id, command }).expect("a frame").to_vec()
}

fn messages(bytes: &[u8]) -> Vec<FromBoard> {
    let mut accumulator = Accumulator::new();
    bytes.iter().filter_map(|&byte| accumulator.push(byte)).map(|m| m.expect("intact")).collect()
}

#[test]
fn an_ideal_wire_is_bit_identical_to_no_wire() {
    let run = |mut board: EmulatedBoard| {
        let mut received = Vec::new();
        for step in 0..200u64 {
            let command = if step % 7 == 0 { Command::Hello(Hello::OURS) } else { Command::Status };
            board.write(&to_board(step as u16, command));
            received.push((board.now(), board.read()));
            board.run_to(Micros(step * 3100)).expect("no rig");
            received.push((board.now(), board.read()));
        }
        received
    };
    let direct = run(EmulatedBoard::new(EMULATED));
    assert!(direct.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() > 5000);
    assert_eq!(direct, run(EmulatedBoard::new(EMULATED).with_wire(Wire::default())));
}

#[test]
fn an_answer_takes_the_latency_of_both_directions() {
    let slow = Lane { latency: milliseconds(10), ..Lane::default() };
    let mut board = EmulatedBoard::new(EMULATED).with_wire(Wire::symmetric(slow, 1));
    board.write(&to_board(1, Command::Hello(Hello::OURS)));
    board.run_to(Micros(19_800)).expect("no rig");
    assert_eq!(board.read(), []);
    board.run_to(Micros(20_200)).expect("no rig");
    assert!(matches!(
        messages(&board.read())[..],
        [FromBoard::Hello(_), FromBoard::Provenance(_), FromBoard::Started(_)]
    ));
}

/// Plant that publishes its motor positions.
struct MonitoredPlant(QuasiStatic, std::sync::Arc<std::sync::Mutex<[f64; 3]>>);

impl Plant for MonitoredPlant {
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        *self.1.lock().expect("a lock") = motors;
        self.0.advance(dt_s, motors)
    }

    fn ball(&self) -> nalgebra::Point3<f64> {
        self.0.ball()
    }

    fn slack(&self) -> [bool; 3] {
        self.0.slack()
    }
}

#[test]
fn a_reboot_keeps_the_rigs_position() {
    use plumb_protocol::config::{Config, Deadlines};
    use plumb_protocol::message::Jog;
    use plumb_protocol::units::{Milliseconds, Rate, Steps16};
    let task = Task::paper();
    let motors = std::sync::Arc::new(std::sync::Mutex::new([0.0; 3]));
    let plant = QuasiStatic::new(task.geometry, task.start).expect("a rig");
    let reboots =
        [1_000_000, 2_000_000].map(|at| Reboot { at: Micros(at), cause: StartCause::Requested });
    let wire = Wire { reboots: reboots.into(), ..Wire::default() };
    let mut board =
        EmulatedBoard::with_plant(EMULATED, Box::new(MonitoredPlant(plant, motors.clone())))
            .with_wire(wire);
    // The test sends no message for up to 1.5 s.
    let example = Config::example();
    let deadlines = Deadlines { host: Milliseconds(5000), ..example.deadlines };
    let config = Config { deadlines, ..example };
    let jog = |board: &mut EmulatedBoard, motor| {
        let jog = Jog { motor, distance: Steps16(100 * 16), rate: Rate(400 << 8) };
        for command in [Command::Hello(Hello::OURS), Command::Configure(config), Command::Jog(jog)]
        {
            board.write(&to_board(1, command));
        }
    };
    jog(&mut board, 0);
    board.run_to(Micros(1_000_000)).expect("a rig that follows");
    let (before, ball) = (board.motors(), board.ball().expect("a rig"));
    assert_eq!(before, [100.0, 0.0, 0.0]);
    board.read();
    board.run_to(Micros(1_500_000)).expect("a rig that follows");
    assert_eq!((board.state(), board.motors()), (State::Unconfigured, [0.0; 3]));
    assert_eq!(*motors.lock().expect("a lock"), before);
    assert_eq!(board.ball(), Some(ball));
    assert_eq!(board.now(), Micros(1_500_000));
    // A board sends nothing before a Hello.
    assert_eq!(board.read(), []);

    // The motors continue from there, also after the second reboot.
    jog(&mut board, 1);
    board.run_to(Micros(2_100_000)).expect("a rig that follows");
    assert_eq!(*motors.lock().expect("a lock"), [100.0, 100.0, 0.0]);
    assert_eq!((board.state(), board.motors()), (State::Unconfigured, [0.0; 3]));
}

#[test]
fn a_board_starts_in_fault_after_a_failure() {
    for cause in [StartCause::Watchdog, StartCause::Panic(1), StartCause::HardFault] {
        let reboots = vec![Reboot { at: Micros(500), cause }];
        let mut board = EmulatedBoard::new(EMULATED).with_wire(Wire { reboots, ..Wire::default() });
        board.run_to(Micros(1000)).expect("no rig");
        assert!(matches!(board.state(), State::Fault(_)), "{cause}");
        board.write(&to_board(1, Command::Hello(Hello::OURS)));
        assert!(messages(&board.read()).contains(&FromBoard::Started(cause)));
    }
}

#[test]
fn a_reboot_loses_unsent_frames() {
    let reboots = vec![Reboot { at: Micros(1000), cause: StartCause::PowerOn }];
    let lane = Lane::on(Line::Frame(milliseconds(5)));
    let wire = Wire { to_host: lane, reboots, ..Wire::default() };
    let mut board = EmulatedBoard::new(EMULATED).with_wire(wire);
    board.write(&to_board(1, Command::Hello(Hello::OURS)));
    board.run_to(Micros(50_000)).expect("no rig");
    assert_eq!(board.read(), []);
    assert_eq!(board.traffic().expect("a wire")[1].dropped, 3);
}

/// A served board keeps the wire's times on a pseudo-terminal. They are measured on the board's
/// clock, so that a busy machine does not change them.
#[test]
fn a_served_board_keeps_the_times_of_its_wire() {
    let lane = Lane { latency: milliseconds(60), ..Lane::on(Line::Baud(9600)) };
    let served = serve(EmulatedBoard::new(EMULATED).with_wire(Wire::symmetric(lane, 1)))
        .expect("a terminal");
    let mut host =
        OpenOptions::new().read(true).write(true).open(served.path()).expect("the terminal");
    let sent = served.board().now();
    let hello = to_board(1, Command::Hello(Hello::OURS));
    host.write_all(&hello).expect("a write");
    let mut buffer = [0; 256];
    let count = host.read(&mut buffer).expect("an answer");
    let took = served.board().now().since(sent);
    let bytes = (hello.len() + count) as u64;
    assert!(
        count > 0 && took >= 120_000 + bytes * 10_000_000 / 9600,
        "{took} µs for {bytes} bytes"
    );
}
