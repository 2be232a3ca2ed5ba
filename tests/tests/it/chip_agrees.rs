//! The real firmware in the emulated chip against the emulated board. The same commands in the same
//! ticks give the same bytes, and the edges on the chip's STEP and DIR pins count the reported
//! steps.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::{Point3, Vector3};
use plumb_core::TICK_US;
use plumb_emulator::plant::{Plant, QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_path::trajectory::Moment;
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{
    Command, Fault, FromBoard, Hello, Position, State, Telemetry, ToBoard,
};
use plumb_protocol::units::{Micros, Point, Steps16};
use plumb_runtime::reference::{INTERVAL_S, reference};
use plumb_runtime::rig::quantity::Current;
use plumb_runtime::rig::{BoardName, Driver, LawName, LawSettings, Rig, UartSettings};
use plumb_tests::chip::{Chip, firmware_image};
use plumb_tests::is_long;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// Period of the positions, µs of the chip's time.
const FRAME_US: u64 = 33_333;

/// Id of every Status.
const STATUS: u16 = 9999;

/// Returns the board's time of its answer to Status: telemetry, then an answer.
fn status_time(received: &[FromBoard]) -> Option<u64> {
    received.windows(2).find_map(|pair| match pair {
        [FromBoard::Telemetry(telemetry), FromBoard::Answer(answer)] if answer.id == STATUS => {
            Some(telemetry.time.0)
        }
        _ => None,
    })
}

/// A chip and an emulated board that receive the same bytes.
struct Pair {
    chip: Chip,
    board: EmulatedBoard,
    plant: QuasiStatic,
    /// All bytes that the emulated board has sent.
    board_bytes: Vec<u8>,
    sequence: u16,
    id: u16,
    /// Time from an accepted position to its telemetry while the board drives, µs: a tick where the
    /// position makes a law request. `None` where it is not looked at.
    acknowledged_after: Option<u64>,
}

impl Pair {
    fn new(chip: Chip) -> Self {
        let task = Task::paper();
        let plant = QuasiStatic::new(task.geometry, task.start).expect("the paper's rig");
        let board = EmulatedBoard::new(EMULATED);
        let mut pair = Self {
            chip,
            board,
            plant,
            board_bytes: Vec::new(),
            sequence: 0,
            id: 0,
            acknowledged_after: None,
        };
        pair.request(Command::Hello(Hello::OURS));
        pair
    }

    /// Sends bytes without an answer to the chip, then to the emulated board in the tick before
    /// that of a Status right behind them: a tick receives one frame.
    fn send(&mut self, bytes: &[u8]) {
        self.send_acknowledged(bytes, |_| None);
    }

    /// Sends bytes and a Status right behind them to the chip, then to the emulated board in the
    /// ticks in which the chip's board received them. `received_at` returns the tick (µs) of the
    /// bytes from the messages of the chip since then; without one it is the tick before the
    /// Status. After a full tick the Status may come a tick later than that.
    fn send_acknowledged(
        &mut self,
        bytes: &[u8],
        received_at: impl Fn(&[FromBoard]) -> Option<u64>,
    ) {
        let mut both = bytes.to_vec();
        both.extend(encode(&ToBoard { id: STATUS, command: Command::Status }).expect("a frame"));
        let before = self.chip.received.len();
        self.chip.send(&both, 10 * u64::from(TICK_US));
        let mut status = status_time(&self.chip.received[before..]);
        if status.is_none() {
            // The first Configure takes 2 ms.
            self.chip.run_us(10 * u64::from(TICK_US));
            status = status_time(&self.chip.received[before..]);
        }
        let status = status.unwrap_or_else(|| {
            panic!("no answer to Status in {:?}", &self.chip.received[before..])
        });
        let received = received_at(&self.chip.received[before..]);
        self.run_board(received.unwrap_or(status - u64::from(TICK_US)));
        self.board.write(bytes);
        self.run_board(status);
        self.board.write(&both[bytes.len()..]);
        self.board_bytes.extend(self.board.read());
    }

    fn request(&mut self, command: Command) {
        self.id += 1;
        let id = self.id;
        let frame = encode(&ToBoard { id, command }).expect("a frame");
        let after = self.acknowledged_after;
        self.send_acknowledged(&frame, |messages| {
            let acknowledged = |message: &FromBoard| match (message, &command) {
                (FromBoard::Telemetry(telemetry), Command::Position(position)) => {
                    let is_named = telemetry.sequence == Some(position.sequence);
                    after.filter(|_| is_named).map(|after| telemetry.time.0 - after)
                }
                _ => None,
            };
            let answered = |message: &FromBoard| match message {
                FromBoard::Answer(answer) if answer.id == id => Some(answer.time.0),
                _ => None,
            };
            // Telemetry acknowledges an accepted position, in the same tick or in the next.
            messages.iter().find_map(|message| answered(message).or(acknowledged(message)))
        });
    }

    fn run_board(&mut self, time: u64) {
        self.board.run_to(Micros(time)).expect("a board without a rig");
        self.board_bytes.extend(self.board.read());
    }

    /// Sends the position of the rig's ball, which follows the chip's edges, and runs for a period.
    fn frame(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        let ball = Point::from_metres(self.plant.ball().into());
        self.request(Command::Position(Position {
            sequence: self.sequence,
            age_us: 20_000,
            ball,
            covariance: None,
        }));
        self.run(FRAME_US - 10 * u64::from(TICK_US));
    }

    /// Runs the chip and the rig for `us` µs.
    fn run(&mut self, us: u64) {
        self.chip.run_us(us);
        self.plant.advance(us as f64 * 1e-6, self.chip.motors).expect("a rig that follows");
    }

    fn telemetry(&self) -> &Telemetry {
        self.chip.received.iter().rev().find_map(telemetry).expect("telemetry")
    }

    fn state(&self) -> State {
        self.telemetry().state
    }

    /// Checks that both have sent the same bytes, up to the shorter output, and that the telemetry
    /// agrees with the edges. What they tell of their programs differs.
    fn assert_agree(&mut self, what: &str) {
        // The emulated board catches up with the chip's last message.
        self.request(Command::Status);
        let [ours, theirs] =
            [&self.board_bytes, &self.chip.usb_bytes].map(|bytes| without_own(bytes));
        let common = ours.len().min(theirs.len());
        assert!(common > 100 && theirs.len() - common < 300 && ours.len() - common < 300);
        if let Some(at) = (0..common).find(|&i| ours[i] != theirs[i]) {
            let (ours, theirs) = (messages(&ours), messages(&theirs));
            let first = ours.iter().zip(&theirs).find(|(a, b)| a != b);
            panic!(
                "{what}: byte {at} of {common} differs; emulated board and chip send {first:#?}"
            );
        }
        assert_eq!(
            self.telemetry().motors.map(Steps16::to_si),
            self.chip.motors,
            "steps counted from the edges"
        );
    }
}

/// Returns the bytes without the frames that tell of a board's program, and of its drivers, which
/// each board asks at its own moments.
fn without_own(bytes: &[u8]) -> Vec<u8> {
    let is_own =
        |message: &FromBoard| matches!(message, FromBoard::Provenance(_) | FromBoard::Drivers(_));
    let is_kept = |frame: &&[u8]| !messages(frame).iter().any(is_own);
    bytes.split_inclusive(|&byte| byte == 0).filter(is_kept).flatten().copied().collect()
}

fn messages(bytes: &[u8]) -> Vec<FromBoard> {
    let mut accumulator = Accumulator::new();
    bytes.iter().filter_map(|&b| accumulator.push(b)).filter_map(Result::ok).collect()
}

fn telemetry(message: &FromBoard) -> Option<&Telemetry> {
    match message {
        FromBoard::Telemetry(telemetry) => Some(telemetry),
        _ => None,
    }
}

/// Starts a chip with the paper's rig and target, and a law.
fn seeking(image: &std::path::Path, law: LawSettings) -> Pair {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law = law;
    let mut pair = Pair::new(Chip::start(image));
    pair.request(Command::Wire(rig.wiring().expect("a wiring")));
    pair.request(Command::Configure(rig.config().expect("a configuration")));
    pair.request(Command::Target(rig.targets().expect("a target")[0]));
    pair
}

/// Starts an SKR Pico, four TMC2209 on its UART, with the paper's rig and target.
fn seeking_on_an_skr_pico(image: &std::path::Path) -> Pair {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.board.kind = BoardName::SkrPico;
    let run_current = Current::constant(0.8);
    rig.motors.driver = Driver::Tmc2209Uart(UartSettings::new(run_current));
    let wiring = rig.wiring().expect("a wiring");
    let mut chip = Chip::start_with(image, &wiring.pins);
    chip.plug_in_skr_drivers();
    let mut pair = Pair::new(chip);
    pair.request(Command::Wire(wiring));
    pair.request(Command::Configure(rig.config().expect("a configuration")));
    // Their drivers take time to be set up, each its own.
    pair.run(300_000);
    pair.request(Command::Target(rig.targets().expect("a target")[0]));
    pair
}

/// Returns law `interval` with a higher gain than the paper's.
fn interval() -> LawSettings {
    let mut law = LawSettings::from(LawName::Interval);
    law.set_gamma(100.0).expect("a gain");
    law
}

/// With every law in the long form. A path is driven with every law in both forms.
#[test]
fn the_papers_task_is_the_same_to_the_bit() {
    let Some(image) = firmware_image() else { return };
    let laws = [interval(), LawName::Taut.into(), LawName::Sign.into(), LawName::Adaptive.into()];
    for law in laws.into_iter().take(if is_long() { 4 } else { 2 }) {
        let name = law.name();
        let mut pair = seeking(&image, law);
        let mut frames = 0;
        while pair.state() != State::Holding {
            pair.frame();
            frames += 1;
            assert!(
                frames < 1000 && pair.state() != State::Fault(Fault::HostSilent),
                "{name}: {}",
                pair.state()
            );
        }
        pair.request(Command::Stop);
        pair.run(600_000);
        pair.assert_agree(name.as_str());
        let error = (pair.plant.ball() - Task::paper().target).norm();
        assert!(error < 0.010, "{name}: {error} m");
    }
}

/// The pulses are counted at the pins of the SKR Pico, where DIR of X and Y is inverted, and by the
/// emulated drivers.
#[test]
fn the_papers_task_is_the_same_on_the_pins_of_an_skr_pico() {
    let Some(image) = firmware_image() else { return };
    let mut pair = seeking_on_an_skr_pico(&image);
    let mut frames = 0;
    while pair.state() != State::Holding {
        pair.frame();
        frames += 1;
        assert!(frames < 1000, "{}", pair.state());
    }
    for pin in [12, 7, 2] {
        assert_eq!(pair.chip.pin_level(pin), 0, "GP{pin}: the drivers are on");
    }
    // ENABLE of driver E is off; fans, heaters and the RGB light are low.
    assert_eq!(pair.chip.pin_level(15), 1);
    for pin in [17, 18, 20, 21, 23, 24] {
        pair.chip.drive_pin(pin, Some(1));
        assert_eq!(pair.chip.pin_level(pin), 0, "GP{pin} is held low");
    }
    pair.request(Command::Stop);
    pair.run(600_000);
    pair.assert_agree("an SKR Pico");
    let drivers = pair.chip.execute(json!({ "drivers": true }))["drivers"].take();
    let counted = [(0, -1.0), (1, -1.0), (2, 1.0)]
        .map(|(index, sign)| sign * drivers[index]["position"].as_f64().expect("a count") / 256.0);
    assert_eq!(counted, pair.chip.motors, "the drivers' own count, full steps");
    let error = (pair.plant.ball() - Task::paper().target).norm();
    assert!(error < 0.010, "{error} m");
}

/// A circle of 5 cm at 5 cm/s, with a message before each picture.
#[test]
fn a_path_is_the_same_to_the_bit_with_every_law() {
    let Some(image) = firmware_image() else { return };
    let Point3 { coords: start } = Task::paper().start;
    let circle = |time: f64| {
        let (sin, cos) = time.sin_cos();
        Moment {
            position: Point3::from(start + 0.05 * Vector3::new(cos - 1.0, sin, 0.0)),
            velocity: 0.05 * Vector3::new(-sin, cos, 0.0),
            acceleration: 0.05 * Vector3::new(-cos, -sin, 0.0),
        }
    };
    for law in LawName::ALL {
        let mut rig = Rig::paper().expect("the paper's rig file");
        rig.law = law.into();
        let mut pair = Pair::new(Chip::start(&image));
        pair.request(Command::Wire(rig.wiring().expect("a wiring")));
        pair.request(Command::Configure(rig.config().expect("a configuration")));
        pair.frame();
        let is_deferred = matches!(law, LawName::Adaptive | LawName::Taut);
        pair.acknowledged_after = Some(if is_deferred { u64::from(TICK_US) } else { 0 });
        for number in 1..=if is_long() { 90 } else { 45 } {
            let reached = pair.telemetry().reference;
            let time = reached.map_or(0.0, |reference| reference.time.0 as f64 * 1e-6);
            let first = (time / INTERVAL_S).floor() * INTERVAL_S;
            let message = reference(number, number % 2 == 0, time, first, circle);
            pair.request(Command::Follow(message));
            pair.frame();
        }
        assert_eq!(pair.state(), State::Following, "{law}");
        let moved = (pair.plant.ball() - Task::paper().start).norm();
        assert!(moved > 0.005, "{law}: {moved} m");
        pair.request(Command::Stop);
        pair.run(600_000);
        pair.assert_agree(law.as_str());
    }
}

/// Each kind of fault, four times in the long form.
#[test]
fn seeded_faults_are_the_same_to_the_bit() {
    faults(0..if is_long() { 20 } else { 5 }, |_| interval());
}

/// The same with the deferred laws, in turn: silence with one and a lost ball with the other, and
/// the other kinds in the long form.
#[test]
fn seeded_faults_are_the_same_to_the_bit_with_deferred_laws() {
    let deferred = |seed: u64| [LawName::Taut, LawName::Adaptive][seed as usize % 2];
    faults(20..if is_long() { 30 } else { 22 }, |seed| deferred(seed).into());
}

/// Compares both with a fault in the first second: silence, positions without a ball, noise, a
/// target or a ball outside the workspace.
fn faults(seeds: std::ops::Range<u64>, law: impl Fn(u64) -> LawSettings) {
    let Some(image) = firmware_image() else { return };
    for seed in seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut pair = seeking(&image, law(seed));
        for _ in 0..random.random_range(3..20) {
            pair.frame();
        }
        match seed % 5 {
            0 => pair.run(700_000),
            1 => (0..20).for_each(|_| {
                pair.request(Command::Position(Position {
                    sequence: pair.sequence,
                    age_us: 0,
                    ball: None,
                    covariance: None,
                }));
                pair.run(30_000);
            }),
            2 => {
                let noise: Vec<u8> =
                    (0..random.random_range(20..60)).map(|_| random.random()).collect();
                pair.send(&[noise.as_slice(), &[0]].concat());
                pair.frame();
            }
            3 => {
                pair.request(Command::Target(Point::from_metres([0.4, 0.4, 2.0]).expect("a point")))
            }
            _ => (0..5).for_each(|_| {
                pair.sequence += 1;
                let ball = Point::from_metres([0.4, 0.4, random.random_range(1.0..3.0)]);
                pair.request(Command::Position(Position {
                    sequence: pair.sequence,
                    age_us: 0,
                    ball,
                    covariance: None,
                }));
                pair.run(30_000);
            }),
        }
        pair.request(Command::Stop);
        // A ramp of 0.2 s, and the moving average of law `taut`.
        pair.run(600_000);
        pair.assert_agree(&format!("seed {seed}"));
    }
}
