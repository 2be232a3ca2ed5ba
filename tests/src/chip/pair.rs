//! The firmware in the emulated chip beside the emulated board: the same commands in the same
//! ticks.

use plumb_core::TICK_US;
use plumb_emulator::plant::{Plant, QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, Hello, Position, State, Telemetry, ToBoard};
use plumb_protocol::units::{Micros, Point, Steps16};

use super::Chip;

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
pub struct Pair {
    /// The chip.
    pub chip: Chip,
    board: EmulatedBoard,
    /// Simulated rig, whose motors follow the chip's edges.
    pub plant: QuasiStatic,
    /// All bytes that the emulated board has sent.
    board_bytes: Vec<u8>,
    /// Sequence number of the last position.
    pub sequence: u16,
    id: u16,
    /// Time from an accepted position to its telemetry while the board drives, µs: a tick where the
    /// position makes a law request. `None` where it is not looked at.
    pub acknowledged_after: Option<u64>,
}

impl Pair {
    /// Connects to a chip and to an emulated board with the rig of a task.
    ///
    /// # Panics
    /// If the cables of the rig cannot hold its ball, or the chip does not answer.
    pub fn new(chip: Chip, task: &Task) -> Self {
        let plant = QuasiStatic::new(task.geometry, task.start).expect("cables that hold");
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
    ///
    /// # Panics
    /// If the chip does not answer.
    pub fn send(&mut self, bytes: &[u8]) {
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

    /// Sends a command to both, whose answers are in [`Chip::received`].
    ///
    /// # Panics
    /// If the chip does not answer.
    pub fn request(&mut self, command: Command) {
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
    ///
    /// # Panics
    /// If the chip does not answer.
    pub fn frame(&mut self) {
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
    ///
    /// # Panics
    /// If the rig cannot follow its motors.
    pub fn run(&mut self, us: u64) {
        self.chip.run_us(us);
        self.plant.advance(us as f64 * 1e-6, self.chip.motors).expect("a rig that follows");
    }

    /// Returns the chip's newest telemetry.
    ///
    /// # Panics
    /// If there is none.
    pub fn telemetry(&self) -> &Telemetry {
        self.chip.received.iter().rev().find_map(telemetry).expect("telemetry")
    }

    /// Returns the state in the chip's newest telemetry.
    pub fn state(&self) -> State {
        self.telemetry().state
    }

    /// Checks that both have sent the same bytes, up to the shorter output, and that the telemetry
    /// agrees with the edges. What they tell of their programs differs.
    ///
    /// # Panics
    /// If they do not agree; `what` names the run.
    pub fn assert_agree(&mut self, what: &str) {
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
        let told = self.telemetry().motors.map(Steps16::to_si);
        let (counted, others) = self.chip.motors.split_at(told.len());
        assert_eq!(told[..], *counted, "steps counted from the edges");
        assert!(others.iter().all(|steps| *steps == 0.0), "a motor that the rig has not");
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
