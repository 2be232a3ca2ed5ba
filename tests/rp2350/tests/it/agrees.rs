//! The real firmware in the emulated RP2350 against the emulated board. The same commands in the
//! same ticks give the same messages, and the edges on the chip's STEP and DIR pins count the
//! reported steps.

use plumb_emulator::plant::{Plant, QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{Command, FromBoard, Hello, Position, State, Telemetry};
use plumb_protocol::units::{Micros, Point};
use plumb_rp2350::{Chip, Firmware, firmware_image};
use plumb_runtime::rig::{BoardName, LawName, LawSettings, Rig};

/// Duration of a tick, µs.
const TICK_US: u64 = 200;
/// Period of the positions, µs of the chip's time.
const FRAME_US: u64 = 33_333;
/// Cycles of a byte to the chip: a frame and a Status behind it come within a tick.
const FAST: u64 = 400;

/// A chip and an emulated board that receive the same frames in the same ticks.
struct Pair {
    chip: Chip,
    board: EmulatedBoard,
    plant: QuasiStatic,
    /// Messages of the emulated board.
    messages: Vec<FromBoard>,
    accumulator: Accumulator,
    sequence: u16,
}

impl Pair {
    /// Starts both with the paper's rig on a Pico 2, its target, and a law.
    fn seeking(firmware: &Firmware, law: LawSettings) -> Self {
        let task = Task::paper();
        let mut chip = Chip::start(firmware);
        chip.set_byte(FAST);
        let mut pair = Self {
            chip,
            board: EmulatedBoard::new(EMULATED),
            plant: QuasiStatic::new(task.geometry, task.start).expect("the paper's rig"),
            messages: Vec::new(),
            accumulator: Accumulator::new(),
            sequence: 0,
        };
        let mut rig = Rig::paper().expect("the paper's rig file");
        rig.board.kind = BoardName::Pico2;
        rig.law = law;
        pair.request(Command::Hello(Hello::OURS));
        pair.request(Command::Wire(rig.wiring().expect("a wiring")));
        pair.request(Command::Configure(rig.config().expect("a configuration")));
        pair.request(Command::Target(rig.targets().expect("a target")[0]));
        pair
    }

    /// Sends a command and a Status right behind it to the chip, and to the emulated board in the
    /// ticks in which the chip's board received them: a tick receives one frame.
    fn request(&mut self, command: Command) {
        let (_, frame) = self.chip.frame(command);
        let (id, status) = self.chip.frame(Command::Status);
        let before = self.chip.received.len();
        self.chip.send(&[frame.clone(), status.clone()].concat());
        self.run(10 * TICK_US);
        let answered = self.chip.received[before..].iter().find_map(|message| match message {
            FromBoard::Answer(answer) if answer.id == id => Some(answer.time.0),
            _ => None,
        });
        let answered = answered.unwrap_or_else(|| {
            panic!("no answer to Status in {:?}", &self.chip.received[before..])
        });
        self.write(answered - TICK_US, &frame);
        self.write(answered, &status);
    }

    /// Has the emulated board receive a frame in the tick at `time`, µs.
    fn write(&mut self, time: u64, frame: &[u8]) {
        self.board.run_to(Micros(time)).expect("a board without a rig");
        self.board.write(frame);
        let bytes = self.board.read();
        let messages = bytes.iter().filter_map(|&byte| self.accumulator.push(byte));
        let messages = messages.filter_map(Result::ok).collect::<Vec<FromBoard>>();
        self.messages.extend(messages);
    }

    /// Sends the position of the rig's ball, which follows the chip's edges, and runs for a period.
    fn frame(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        let ball = Point::from_metres(self.plant.ball().into());
        let (sequence, age_us, covariance) = (self.sequence, 20_000, None);
        self.request(Command::Position(Position { sequence, age_us, ball, covariance }));
        self.run(FRAME_US - 10 * TICK_US);
    }

    /// Runs the chip and the rig for `us` µs.
    fn run(&mut self, us: u64) {
        self.chip.run_us(us);
        let motors = self.chip.pins.motors.map(|motor| motor.position as f64 / 16.0);
        self.plant.advance(us as f64 * 1e-6, motors).expect("a rig that follows");
    }

    fn telemetry(&self) -> &Telemetry {
        let telemetry = |message| match message {
            &FromBoard::Telemetry(ref telemetry) => Some(telemetry),
            _ => None,
        };
        self.chip.received.iter().rev().find_map(telemetry).expect("telemetry")
    }

    /// Checks that both have sent the same messages, up to the shorter output, and that the
    /// telemetry agrees with the edges. What they tell of their programs differs.
    fn assert_agree(&mut self, what: &str) {
        self.request(Command::Status);
        let is_kept = |message: &&FromBoard| !matches!(message, FromBoard::Provenance(_));
        let [ours, theirs] = [&self.messages, &self.chip.received]
            .map(|messages| messages.iter().filter(is_kept).collect::<Vec<_>>());
        assert!(ours.len() > 100 && ours.len().abs_diff(theirs.len()) < 10, "{what}");
        let difference = ours.iter().zip(&theirs).find(|(ours, theirs)| ours != theirs);
        assert!(difference.is_none(), "{what}: emulated board and chip send {difference:#?}");
        let counted = self.chip.pins.motors.map(|motor| motor.position);
        let told = self.telemetry().motors.map(|motor| i64::from(motor.0));
        assert_eq!(told, counted, "{what}: steps counted from the edges");
    }
}

#[test]
fn the_papers_task_is_the_same_to_the_bit_with_every_law() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    for law in [LawName::Interval] {
        let t = std::time::Instant::now();
        let mut pair = Pair::seeking(&firmware, law.into());
        println!("seeking {:?} {:?}", t.elapsed(), pair.chip.received);
        for _ in 0..20 { pair.frame(); println!("{:?} {:?} {:?}", t.elapsed(), pair.telemetry(), pair.chip.pins.motors); }
        pair.assert_agree("short");
        let mut frames = 0;
        while pair.telemetry().state != State::Holding && frames < 1000 {
            pair.frame();
            frames += 1;
        }
        assert_eq!(pair.telemetry().state, State::Holding, "{law}");
        pair.request(Command::Stop);
        pair.run(600_000);
        pair.assert_agree(law.as_str());
        let error = (pair.plant.ball() - Task::paper().target).norm();
        assert!(error < 0.010, "{law}: {error} m");
    }
}
