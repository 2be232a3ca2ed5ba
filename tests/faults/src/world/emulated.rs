//! The emulated board.

use nalgebra::Point3;
use plumb_emulator::{DriverTrouble, EMULATED, EmulatedBoard};
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;

use super::machine::Machine;
use super::power::Power;
use super::rig::FaultyRig;
use super::witness::Witness;
use crate::plan::Plan;

/// Emulated board with a rig. Its tick is that of the board.
pub(super) struct Emulated {
    board: EmulatedBoard,
    witness: Witness,
    power: Power,
}

impl Emulated {
    /// Returns the board of a plan, which has just started.
    pub(super) fn new(plan: &Plan) -> Self {
        let mut board = EmulatedBoard::with_plant(EMULATED, Box::new(FaultyRig::new(plan)));
        for fault in &plan.faults {
            if let Some(trouble) = fault.driver_trouble() {
                let (motor, time) = (fault.motor as u8, fault.from..fault.to);
                board.trouble_driver(DriverTrouble { motor, trouble, time });
            }
        }
        Self { witness: Witness::new(plan.seed, &board), power: Power::new(plan), board }
    }
}

impl Machine for Emulated {
    fn now(&self) -> Micros {
        self.board.now()
    }

    fn tick(&mut self, frames: &[Vec<u8>]) -> Vec<u8> {
        let now = self.now();
        let mut sent = self.power.act(&mut self.board, &mut self.witness);
        for frame in frames {
            sent.extend(self.witness.deliver(&mut self.board, frame));
        }
        sent.extend(self.witness.tick(&mut self.board, self.power.inputs(now)));
        sent
    }

    fn ball(&self) -> Point3<f64> {
        self.board.ball().unwrap_or_else(Point3::origin)
    }

    fn state(&self) -> State {
        self.board.state()
    }

    fn is_at_rest(&self) -> bool {
        self.board.rates() == [0.0; 3]
    }

    fn violations(&self) -> Vec<String> {
        self.witness.violations()
    }
}
