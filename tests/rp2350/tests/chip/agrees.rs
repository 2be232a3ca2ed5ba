//! The real firmware in the emulated RP2350 against the emulated board. The same commands in the
//! same ticks give the same messages, and the edges on the chip's STEP and DIR pins count the
//! reported steps.

use plumb_emulator::plant::{Plant, QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{Command, FromBoard, Hello, Position, State, Telemetry};
use plumb_protocol::units::{Micros, Point, Rate};
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_rp2350::{Chip, Firmware, firmware_image};
use plumb_runtime::rig::{BoardName, LawName, LawSettings, Rig};

/// Duration of a tick, µs.
const TICK_US: u64 = 200;
/// Period of the positions, µs of the chip's time.
const FRAME_US: u64 = 33_333;
/// Cycles of a byte to the chip: a frame and a Status behind it come within a tick.
const FAST: u64 = 400;

/// The driver: its pulses of 1.9 µs are seen in quanta of 64 cycles.
const DRIVER: StepDir = StepDir::DRV8825;

/// A chip and an emulated board that receive the same frames in the same ticks.
struct Pair {
    chip: Chip,
    board: EmulatedBoard,
    plant: QuasiStatic,
    /// Messages of the emulated board.
    messages: Vec<FromBoard>,
    accumulator: Accumulator,
    sequence: u16,
    /// Time from a position to its telemetry while the board drives, µs: a tick where the position
    /// makes a request to a deferred law.
    acknowledged_after: u64,
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
            acknowledged_after: 0,
        };
        let mut rig = Rig::paper().expect("the paper's rig file");
        rig.board.kind = BoardName::Pico2;
        rig.law = law.clone();
        pair.request(Command::Hello(Hello::OURS));
        let mut wiring = rig.wiring().expect("a wiring");
        wiring.drivers = Drivers::StepDir(DRIVER);
        pair.request(Command::Wire(wiring));
        pair.request(Command::Configure(rig.config().expect("a configuration")));
        // The pins have the levels of the state machines from here on.
        pair.chip.pins.motors = Default::default();
        pair.request(Command::Target(rig.targets().expect("a target")[0]));
        if matches!(law.name(), LawName::Adaptive | LawName::Taut) {
            pair.acknowledged_after = TICK_US;
        }
        pair
    }

    /// Sends a command and a Status right behind it to the chip, and to the emulated board in the
    /// ticks in which the chip's board received them: a tick receives one frame.
    fn request(&mut self, command: Command) {
        let (id, frame) = self.chip.frame(command);
        let (status_id, status) = self.chip.frame(Command::Status);
        let before = self.chip.received.len();
        self.chip.send(&[frame.clone(), status.clone()].concat());
        self.run(10 * TICK_US);
        let messages = &self.chip.received[before..];
        let answered = |wanted: u16| {
            messages.iter().find_map(|message| match message {
                FromBoard::Answer(answer) if answer.id == wanted => Some(answer.time.0),
                _ => None,
            })
        };
        let status_at = answered(status_id);
        let Some(status_at) = status_at else {
            panic!("no answer to Status; scratch registers: {:x?}", self.chip.scratch())
        };
        // Telemetry acknowledges an accepted position.
        let sequence = match command {
            Command::Position(position) => Some(position.sequence),
            _ => None,
        };
        let acknowledged = messages.iter().find_map(|message| match message {
            FromBoard::Telemetry(telemetry) if sequence.is_some() => {
                (telemetry.sequence == sequence).then(|| telemetry.time.0 - self.acknowledged_after)
            }
            _ => None,
        });
        let received_at = answered(id).or(acknowledged).unwrap_or(status_at - TICK_US);
        self.write(received_at, &frame);
        self.write(status_at, &status);
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

    /// Runs until the motors stand, a second at most.
    fn wait_for_rest(&mut self) {
        for _ in 0..20 {
            self.run(50_000);
            self.request(Command::Status);
            if self.telemetry().rates == [Rate(0); 3] {
                return;
            }
        }
        panic!("the motors turn: {:?}", self.telemetry());
    }

    fn telemetry(&self) -> &Telemetry {
        let messages = self.chip.received.iter().rev();
        let mut telemetry = messages.filter_map(|message| match message {
            FromBoard::Telemetry(telemetry) => Some(telemetry),
            _ => None,
        });
        telemetry.next().expect("telemetry")
    }

    /// Checks that both have sent the same messages, up to the shorter output, and that the
    /// telemetry agrees with the edges. What they tell of their programs differs.
    fn assert_agree(&mut self, what: &str) {
        self.request(Command::Status);
        let is_kept = |message: &&FromBoard| !matches!(message, FromBoard::Provenance(_));
        let [ours, theirs] = [&self.messages, &self.chip.received]
            .map(|messages| messages.iter().filter(is_kept).collect::<Vec<_>>());
        assert!(ours.len() > 50 && ours.len().abs_diff(theirs.len()) < 10, "{what}");
        let difference = ours.iter().zip(&theirs).find(|(ours, theirs)| ours != theirs);
        assert!(difference.is_none(), "{what}: emulated board and chip send {difference:#?}");
        let counted = self.chip.pins.motors.map(|motor| motor.position);
        let told = self.telemetry().motors.map(|motor| i64::from(motor.0));
        assert_eq!(told, counted, "{what}: steps counted from the edges");
    }
}

/// In the long form (`PLUMB_LONG`) until the ball is held at the target, else for 0.8 s.
#[test]
fn the_papers_task_is_the_same_to_the_bit_with_every_law() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    let is_long = std::env::var_os("PLUMB_LONG").is_some();
    for law in [LawName::Interval, LawName::Sign, LawName::Adaptive, LawName::Taut] {
        let mut pair = Pair::seeking(&firmware, law.into());
        let frames = if is_long { 1000 } else { 24 };
        for _ in 0..frames {
            pair.frame();
            if pair.telemetry().state == State::Holding {
                break;
            }
        }
        let state = if is_long { State::Holding } else { State::Seeking };
        assert_eq!(pair.telemetry().state, state, "{law}");
        pair.request(Command::Stop);
        pair.wait_for_rest();
        pair.assert_agree(law.as_str());
        let moved = (pair.plant.ball() - Task::paper().start).norm();
        let error = (pair.plant.ball() - Task::paper().target).norm();
        assert!(moved > 0.005, "{law}: {moved} m");
        assert!(!is_long || error < 0.010, "{law}: {error} m");
    }
}
