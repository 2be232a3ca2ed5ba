//! Tests of an emulated board on a link.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::time::Duration;

use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, Hello, State, ToBoard};
use plumb_protocol::{MOTORS, PerMotor};

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
struct MonitoredPlant(QuasiStatic, std::sync::Arc<std::sync::Mutex<PerMotor<f64>>>);

impl Plant for MonitoredPlant {
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        *self.1.lock().expect("a lock") = motors;
        self.0.advance(dt_s, motors)
    }

    fn ball(&self) -> nalgebra::Point3<f64> {
        self.0.ball()
    }

    fn slack(&self) -> PerMotor<bool> {
        self.0.slack()
    }
}

#[test]
fn a_reboot_keeps_the_rigs_position() {
    use plumb_protocol::Wiring;
    use plumb_protocol::config::{Config, Deadlines};
    use plumb_protocol::message::Jog;
    use plumb_protocol::units::{Milliseconds, Rate, Steps16};
    let task = Task::paper();
    let motors = std::sync::Arc::new(std::sync::Mutex::new([0.0; MOTORS]));
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
        for command in [
            Command::Hello(Hello::OURS),
            Command::Wire(Wiring::example()),
            Command::Configure(config),
            Command::Jog(jog),
        ] {
            board.write(&to_board(1, command));
        }
    };
    jog(&mut board, 0);
    board.run_to(Micros(1_000_000)).expect("a rig that follows");
    let (before, ball) = (board.motors(), board.ball().expect("a rig"));
    assert_eq!(before, [100.0, 0.0, 0.0]);
    board.read();
    board.run_to(Micros(1_500_000)).expect("a rig that follows");
    assert_eq!((board.state(), board.motors()), (State::Unconfigured, [0.0; MOTORS]));
    assert_eq!(*motors.lock().expect("a lock"), before);
    assert_eq!(board.ball(), Some(ball));
    assert_eq!(board.now(), Micros(1_500_000));
    // A board sends nothing before a Hello.
    assert_eq!(board.read(), []);

    // The motors continue from there, also after the second reboot.
    jog(&mut board, 1);
    board.run_to(Micros(2_100_000)).expect("a rig that follows");
    assert_eq!(*motors.lock().expect("a lock"), [100.0, 100.0, 0.0]);
    assert_eq!((board.state(), board.motors()), (State::Unconfigured, [0.0; MOTORS]));
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

/// Returns a frame of `length` bytes filled with `mark`.
fn frame(length: usize, mark: u8) -> Vec<u8> {
    let mut frame = vec![mark; length - 1];
    frame.push(0);
    frame
}

fn transmitter(lane: Lane) -> Transmitter {
    Transmitter::new(lane, Vec::new(), TO_BOARD_BUFFER, 1, 0)
}

/// Returns each frame that arrives by `end` with its arrival time, both times in microseconds.
fn arrivals(transmitter: &mut Transmitter, end: u64) -> Vec<(u64, Vec<u8>)> {
    let mut arrived = Vec::new();
    for now in 0..=end {
        while let Some(frame) = transmitter.receive(Micros(now)) {
            arrived.push((now, frame));
        }
    }
    arrived
}

#[test]
fn a_frame_takes_ten_bits_a_byte_and_the_latency() {
    let lane = Lane { latency: milliseconds(2), ..Lane::on(Line::Baud(115_200)) };
    let mut wire = transmitter(lane);
    wire.send(Micros(100), &frame(30, 1));
    // The second frame waits for the line: 60 bytes take 5208.3 µs.
    wire.send(Micros(150), &frame(30, 2));
    let expected = [(100 + 2605 + 2000, frame(30, 1)), (100 + 5209 + 2000, frame(30, 2))];
    assert_eq!(arrivals(&mut wire, 10_000), expected);
}

#[test]
fn the_rounding_of_frames_does_not_add_up() {
    let mut wire = transmitter(Lane::on(Line::Baud(921_600)));
    for _ in 0..400 {
        wire.send(Micros(0), &frame(7, 1));
    }
    // 2800 bytes take 30 381.9 µs. Frames rounded up one by one would take 30 400 µs.
    let arrived = arrivals(&mut wire, 40_000);
    assert_eq!((arrived.len(), arrived[399].0), (400, 30_382));
}

#[test]
fn every_frame_takes_the_same_time_on_a_frame_line() {
    let mut wire = transmitter(Lane::on(Line::Frame(Duration::from_micros(300))));
    wire.send(Micros(0), &[frame(5, 1), frame(200, 2), frame(1, 0)].concat());
    wire.send(Micros(5000), &frame(9, 3));
    let arrived: Vec<_> =
        arrivals(&mut wire, 6000).into_iter().map(|(at, frame)| (at, frame.len())).collect();
    assert_eq!(arrived, [(300, 5), (600, 200), (900, 1), (5300, 9)]);
}

#[test]
fn a_frame_starts_when_its_zero_is_sent() {
    let mut wire = transmitter(Lane::default());
    wire.send(Micros(0), &[7, 7]);
    assert_eq!(wire.receive(Micros(1000)), None);
    wire.send(Micros(2000), &[7, 0, 8]);
    assert_eq!(wire.receive(Micros(2000)), Some(vec![7, 7, 7, 0]));
    // Bytes without a zero are sent as soon as they fill a frame.
    wire.send(Micros(3000), &[8; 255]);
    assert_eq!(wire.receive(Micros(3000)), Some(vec![8; 256]));
}

#[test]
fn frames_are_lost_damaged_and_doubled_as_often_as_set() {
    let lane = Lane { lost: 0.1, damaged: 0.05, doubled: 0.02, ..Lane::default() };
    let mut wire = transmitter(lane);
    let (sent, mut intact, mut arrived) = (100_000u64, 0u64, 0u64);
    for now in 0..sent {
        wire.send(Micros(now), &frame(20, 9));
        while let Some(bytes) = wire.receive(Micros(now)) {
            arrived += 1;
            intact += u64::from(bytes == frame(20, 9));
        }
    }
    let traffic = wire.traffic();
    let near = |count: u64, expected: f64| {
        let deviation = expected.sqrt();
        assert!((count as f64 - expected).abs() < 4.0 * deviation, "{count} of {expected}");
    };
    near(traffic.doubled, 2000.0);
    near(traffic.lost, 0.1 * traffic.sent as f64);
    near(traffic.damaged, 0.05 * 0.9 * traffic.sent as f64);
    assert_eq!(traffic.sent, sent + traffic.doubled);
    assert_eq!(arrived, traffic.sent - traffic.lost);
    assert_eq!((intact, traffic.dropped), (arrived - traffic.damaged, 0));
}

#[test]
fn damage_flips_loses_doubles_and_inserts() {
    let mut wire = transmitter(Lane { damaged: 1.0, ..Lane::default() });
    let whole: Vec<u8> = (1..=40).chain([0]).collect();
    let (mut shorter, mut longer, mut flipped) = (0, 0, 0);
    for now in 0..1000 {
        wire.send(Micros(now), &whole);
        let bytes = wire.receive(Micros(now)).expect("a damaged frame");
        assert_ne!(bytes, whole);
        match bytes.len() {
            40 => shorter += 1,
            42 => longer += 1,
            _ => {
                let bits = bytes.iter().zip(&whole).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
                assert_eq!(bits, 1);
                flipped += 1;
            }
        }
    }
    assert!(shorter > 200 && longer > 400 && flipped > 200, "{shorter} {longer} {flipped}");
}

#[test]
fn the_same_seed_gives_the_same_traffic() {
    let lane = Lane { lost: 0.2, damaged: 0.2, doubled: 0.2, ..Lane::on(Line::Baud(921_600)) };
    let run = |seed, stream| {
        let mut wire = Transmitter::new(lane.clone(), Vec::new(), TO_BOARD_BUFFER, seed, stream);
        for mark in 1..100 {
            wire.send(Micros(0), &frame(12, mark));
        }
        arrivals(&mut wire, 30_000)
    };
    assert_eq!(run(5, 0), run(5, 0));
    assert_ne!(run(5, 0), run(6, 0));
    assert_ne!(run(5, 0), run(5, 1));
}

#[test]
fn frames_that_do_not_fit_the_buffer_are_dropped() {
    let lane = Lane { latency: milliseconds(500), ..Lane::on(Line::Frame(milliseconds(1))) };
    let mut wire = Transmitter::new(lane, Vec::new(), 100, 1, 0);
    for mark in 1..=20 {
        wire.send(Micros(0), &frame(30, mark));
    }
    assert_eq!(wire.traffic().dropped, 17);
    // A frame that has left the buffer frees its space before it arrives.
    wire.send(Micros(1000), &frame(30, 21));
    let marks: Vec<_> = arrivals(&mut wire, 600_000).iter().map(|(_, frame)| frame[0]).collect();
    assert_eq!(marks, [1, 2, 3, 21]);
}

#[test]
fn frames_in_a_silence_are_lost() {
    let silences = vec![Silence { from: Micros(10_000), to: Micros(20_000) }];
    let lane = Lane { latency: milliseconds(1), ..Lane::on(Line::Frame(milliseconds(1))) };
    let mut wire = Transmitter::new(lane, silences, TO_BOARD_BUFFER, 1, 0);
    let mut received = Vec::new();
    for now in 0..30_000 {
        if now % 3000 == 0 {
            wire.send(Micros(now), &frame(9, (now / 1000 + 1) as u8));
        }
        received.extend(wire.receive(Micros(now)).map(|frame| (now, frame[0])));
    }
    // The frames sent at 9, 12, 15 and 18 ms are on the link during the silence.
    let expected = [0, 3, 6, 21, 24, 27].map(|ms| (ms * 1000 + 2000, ms as u8 + 1));
    assert_eq!(received, expected);
}
