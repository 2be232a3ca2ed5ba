//! The real firmware in the emulated chip (`tests/chip`), in lock step: the chip's time passes only
//! during calls.

mod emulator;
mod pair;
mod port;
pub mod reach;
mod session;
mod symbols;

use std::path::{Path, PathBuf};

use plumb_protocol::boards;
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::FromBoard;
use plumb_protocol::wiring::{MotorPins, Pins};
use serde_json::{Value, json};

use emulator::Emulator;
pub use pair::Pair;
pub use port::ChipPort;
pub use session::{BALL_UM, FAR_TARGET_UM, Pulses, REVERSING_BALL_UM, Setup, fast_config, point};
pub use symbols::symbol_address;

/// Processor cycles per microsecond.
pub const CYCLES_PER_US: u64 = 125;

/// Pin of a Pico's enable line; low enables the drivers.
pub const ENABLE: u8 = 14;

/// Pin of a Pico's emergency input; low if the emergency loop is closed.
pub const EMERGENCY: u8 = 15;
/// Time that the emergency input must be open to stop the board, µs: `ESTOP_FILTER_US` in
/// firmware/src/generator/program.rs.
pub const EMERGENCY_FILTER_US: u64 = 50;

/// Returns the path of the firmware image: `PLUMB_ELF`, or the result of `make firmware`. Returns
/// `None` if there is none.
///
/// # Panics
/// If there is no image and CI is set.
pub fn firmware_image() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let image = std::env::var_os("PLUMB_ELF")
        .map_or_else(|| root.join("target/firmware/plumb.elf"), PathBuf::from);
    if image.exists() {
        return Some(image);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing: make firmware", image.display());
    println!("skipped: {} is missing (make firmware)", image.display());
    None
}

/// A running chip.
pub struct Chip {
    emulator: Emulator,
    accumulator: Accumulator,
    /// Cycles since power-on.
    pub cycle: u64,
    /// Motor positions since power-on, full steps, counted from the edges on STEP and DIR; + pays
    /// out.
    pub motors: [f64; 3],
    /// All bytes that the board has sent over USB.
    pub usb_bytes: Vec<u8>,
    /// All messages that the board has sent over USB.
    pub received: Vec<FromBoard>,
    /// Cycle, number and level of each edge at the pins of `list`.
    pub edges: Vec<[u64; 3]>,
    /// Number of the steppers that were named before those of [`motors`](Self::motors).
    former_steppers: usize,
    /// Number of the steppers that count the motors' steps.
    steppers: usize,
    /// Id of the last command.
    id: u16,
    /// Sequence number of the last position.
    sequence: u16,
}

impl Chip {
    /// Powers a Pico on with the emergency loop closed, and waits for USB.
    ///
    /// # Panics
    /// If Node or its packages are missing, or if the image does not start.
    pub fn start(image: &Path) -> Self {
        Self::start_with(image, &boards::PICO.pins)
    }

    /// Powers a chip on with drivers and a closed emergency loop at these pins, and waits for USB.
    /// The pulses at an inverted STEP pin are not counted.
    ///
    /// # Panics
    /// If Node or its packages are missing, or if the image does not start.
    pub fn start_with(image: &Path, pins: &Pins) -> Self {
        let mut chip = Self {
            emulator: Emulator::start(image),
            accumulator: Accumulator::new(),
            cycle: 0,
            motors: [0.0; 3],
            usb_bytes: Vec::new(),
            received: Vec::new(),
            edges: Vec::new(),
            former_steppers: 0,
            steppers: 0,
            id: 0,
            sequence: 0,
        };
        let closed = [pins.emergency.number, u8::from(pins.emergency.inverted)];
        chip.execute(json!({ "gpio": closed }));
        chip.count_steps_at(pins);
        chip.wait_for_usb();
        chip
    }

    /// Counts the steps at these pins from now on; the positions begin at zero.
    ///
    /// # Panics
    /// If the chip's process has ended or reports an error.
    pub fn count_steps_at(&mut self, pins: &Pins) {
        let stepper = |motor: &MotorPins| {
            json!([motor.step.number, motor.direction.number, motor.direction.inverted])
        };
        let steppers: Vec<Value> = pins.motors.iter().map(stepper).collect();
        self.motors = [0.0; 3];
        self.former_steppers += self.steppers;
        self.steppers = steppers.len();
        self.execute(json!({ "steppers": steppers }));
    }

    /// Runs the chip until USB is configured, after power-on or after plugging in.
    ///
    /// # Panics
    /// If that takes more than half a second.
    pub fn wait_for_usb(&mut self) {
        let ready = (0..100).any(|_| {
            let reply = self.run_us(5000);
            reply["states"]
                .as_array()
                .is_some_and(|states| states.iter().any(|state| state[1] == "ready"))
        });
        assert!(ready, "USB is not configured");
    }

    /// Executes a command of tests/chip/README.md and returns the reply.
    ///
    /// # Panics
    /// If the chip's process has ended or reports an error.
    pub fn execute(&mut self, command: Value) -> Value {
        let reply = self.emulator.execute(&command);
        self.cycle = reply["cycle"].as_u64().expect("a cycle");
        if let Some(steps) = reply["steps"].as_array() {
            let named = steps.iter().skip(self.former_steppers);
            for (motor, steps) in self.motors.iter_mut().zip(named) {
                *motor = steps.as_f64().expect("a position") / 16.0;
            }
        }
        for edge in reply["edges"].as_array().into_iter().flatten() {
            self.edges.push([0, 1, 2].map(|i| edge[i].as_u64().expect("a number")));
        }
        self.receive_all(&reply);
        reply
    }

    /// Runs the chip for `us` µs of its time.
    pub fn run_us(&mut self, us: u64) -> Value {
        self.execute(json!({ "run_us": us }))
    }

    /// Sends bytes over USB, then runs the chip for `us` µs.
    pub fn send(&mut self, bytes: &[u8], us: u64) -> Value {
        let hex: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        self.execute(json!({ "usb": hex }));
        self.run_us(us)
    }

    /// Parses the bytes of a reply. A frame that a restart has torn is dropped.
    fn receive_all(&mut self, reply: &Value) {
        let last = reply["resets"].as_array().and_then(|resets| resets.last());
        let mut restart = last.and_then(|reset| reset[0].as_u64());
        for burst in reply["usb"].as_array().into_iter().flatten() {
            if restart.take_if(|restart| burst[0].as_u64() > Some(*restart)).is_some() {
                self.accumulator = Accumulator::new();
            }
            self.receive(burst[1].as_str().expect("bytes"));
        }
        if restart.is_some() {
            self.accumulator = Accumulator::new();
        }
    }

    /// Parses a burst of USB bytes, in hexadecimal.
    fn receive(&mut self, hex: &str) {
        for at in (0..hex.len()).step_by(2) {
            let byte = u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
            self.usb_bytes.push(byte);
            if let Some(message) = self.accumulator.push(byte) {
                self.received.push(message.expect("the emulated link is lossless"));
            }
        }
    }
}
