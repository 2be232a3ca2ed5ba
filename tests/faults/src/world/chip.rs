//! The real firmware in the emulated chip.

mod checks;

use std::path::Path;

use nalgebra::Point3;
use plumb_emulator::plant::Plant;
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{FromBoard, State};
use plumb_protocol::units::Micros;
use plumb_tests::chip::{Chip, ENABLE};
use serde_json::{Value, json};

use super::machine::Machine;
use super::rig::FaultyRig;
use crate::kind::Kind;
use crate::plan::{Fault, Plan};
use checks::Checks;

/// Time that the chip runs in a tick of the world, µs.
const TICK_US: u64 = 1000;
/// Processor cycles per microsecond.
const CYCLES_PER_US: u64 = plumb_tests::chip::CYCLES_PER_US;

/// The chip with a rig. What is known of its board comes from its pins and its messages.
pub(super) struct ChipMachine {
    chip: Chip,
    rig: FaultyRig,
    faults: Vec<Fault>,
    /// Restarts that have not happened yet.
    restarts: Vec<Fault>,
    is_open: bool,
    /// The chip's time at the start of the world, µs.
    start_us: u64,
    accumulator: Accumulator,
    state: State,
    checks: Checks,
}

impl ChipMachine {
    /// Powers a chip with this firmware on, for a plan.
    pub(super) fn start(plan: &Plan, image: &Path) -> Self {
        let mut chip = Chip::start(image);
        // The pull-up resistor of the enable line.
        chip.drive_pin(ENABLE, Some(1));
        let is_restart = |fault: &&Fault| matches!(fault.kind, Kind::Reset | Kind::Crash);
        Self {
            start_us: chip.us(),
            checks: Checks::new(plan, chip.motors),
            chip,
            rig: FaultyRig::new(plan),
            restarts: plan.faults.iter().filter(is_restart).copied().collect(),
            faults: plan.faults.clone(),
            is_open: false,
            accumulator: Accumulator::new(),
            state: State::Unconfigured,
        }
    }

    /// Restarts the chip or hangs it, and opens or closes the emergency input.
    fn act(&mut self, now: Micros) {
        while let Some(index) = self.restarts.iter().position(|fault| fault.from <= now) {
            let fault = self.restarts.remove(index);
            match fault.kind {
                Kind::Crash => self.chip.hang(),
                _ => {
                    let cause = if fault.strength < 0.5 { "power" } else { "run" };
                    let reply = self.chip.execute(json!({ "reset": cause }));
                    self.note_resets(&reply);
                }
            }
        }
        let is_open = self.faults.iter().any(|fault| fault.opens_emergency(now));
        if is_open != self.is_open {
            self.chip.set_emergency(is_open);
            self.is_open = is_open;
        }
    }

    /// Takes in the restarts of a reply.
    fn note_resets(&mut self, reply: &Value) {
        if !reply["resets"].is_null() {
            self.checks.restarted(self.now(), self.chip.motors);
            (self.accumulator, self.state) = (Accumulator::new(), State::Unconfigured);
        }
    }

    /// Takes in what the board has sent.
    fn note_messages(&mut self, bytes: &[u8]) {
        let now = self.now();
        for byte in bytes {
            match self.accumulator.push::<FromBoard>(*byte) {
                Some(Ok(FromBoard::Telemetry(telemetry))) => {
                    self.state = telemetry.state;
                    self.checks.told(now, &telemetry);
                }
                Some(Ok(FromBoard::Fault(report))) => self.state = State::Fault(report.fault),
                _ => {}
            }
        }
    }
}

impl Machine for ChipMachine {
    fn now(&self) -> Micros {
        Micros(self.chip.cycle / CYCLES_PER_US - self.start_us)
    }

    fn tick(&mut self, frames: &[Vec<u8>]) -> Vec<u8> {
        self.act(self.now());
        let hex: String = frames.concat().iter().map(|byte| format!("{byte:02x}")).collect();
        let before = self.chip.usb_bytes.len();
        let reply = self.chip.execute(json!({ "usb": hex, "run_us": TICK_US }));
        let now = self.now();
        if !frames.is_empty() {
            self.checks.heard(now);
        }
        self.note_resets(&reply);
        let sent = self.chip.usb_bytes[before..].to_vec();
        self.note_messages(&sent);
        self.checks.moved(now, self.chip.motors, self.state);
        // The rig bears everything.
        let _ = self.rig.advance(TICK_US as f64 * 1e-6, self.chip.motors);
        sent
    }

    fn ball(&self) -> Point3<f64> {
        self.rig.ball()
    }

    fn state(&self) -> State {
        self.state
    }

    fn is_at_rest(&self) -> bool {
        self.checks.is_at_rest()
    }

    fn violations(&self) -> Vec<String> {
        self.checks.violations().to_vec()
    }
}
