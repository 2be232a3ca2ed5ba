//! Faults of the power and of the board's inputs.

use plumb_emulator::EmulatedBoard;
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::witness::{Inputs, Witness};
use crate::kind::Kind;
use crate::plan::{Fault, Plan};

/// The board's supply and its inputs.
pub(super) struct Power {
    faults: Vec<Fault>,
    random: ChaCha8Rng,
    /// Whether the emergency input is open.
    is_open: bool,
    /// Restarts that have not happened yet.
    restarts: Vec<(Micros, StartCause)>,
}

impl Power {
    pub(super) fn new(plan: &Plan) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
        random.set_stream(5);
        let restarts = plan.faults.iter().filter_map(|fault| Some((fault.from, cause(fault)?)));
        Self { restarts: restarts.collect(), faults: plan.faults.clone(), random, is_open: false }
    }

    /// Returns the inputs of the board at `now`.
    pub(super) fn inputs(&self, now: Micros) -> Inputs {
        let is_silent = |fault: &Fault| fault.kind == Kind::DriverBus && fault.acts(now);
        Inputs {
            is_emergency: self.faults.iter().any(|fault| fault.opens_emergency(now)),
            is_driver_silent: self.faults.iter().any(is_silent),
        }
    }

    /// Restarts the board if that is due, and opens or closes the emergency input. Returns the
    /// board's messages.
    pub(super) fn act(&mut self, board: &mut EmulatedBoard, witness: &mut Witness) -> Vec<u8> {
        let now = board.now();
        while let Some(index) = self.restarts.iter().position(|(at, _)| *at <= now) {
            let (_, cause) = self.restarts.remove(index);
            board.restart(cause);
            witness.restarted(board);
        }
        let is_open = self.inputs(now).is_emergency;
        let was_open = std::mem::replace(&mut self.is_open, is_open);
        if self.is_open {
            // The hardware has cut some pulses of the last tick.
            let missing = if was_open { [0; 3] } else { self.missing(board) };
            return witness.cut(board, missing);
        }
        if was_open {
            witness.closed();
        }
        Vec::new()
    }

    /// Returns a random number of pulses of the last plan, + if the direction line is high.
    fn missing(&mut self, board: &EmulatedBoard) -> [i32; 3] {
        board.core().pulses().motors.map(|motor| {
            let count = self.random.random_range(0..=i32::from(motor.count));
            if motor.direction { count } else { -count }
        })
    }
}

/// Returns the cause of the start after a fault that restarts the board.
fn cause(fault: &Fault) -> Option<StartCause> {
    let causes: &[StartCause] = match fault.kind {
        Kind::Reset => &[StartCause::PowerOn, StartCause::ResetPin],
        Kind::Crash => &[StartCause::Watchdog, StartCause::Panic(1), StartCause::HardFault],
        _ => return None,
    };
    Some(causes[fault.seed as usize % causes.len()])
}
