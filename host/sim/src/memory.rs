//! A transport to an emulated board in memory.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use plumb_emulator::EmulatedBoard;
use plumb_protocol::units::Micros;
use plumb_runtime::link::{LinkError, Transport};

use crate::simulated::SimulationError;

/// Transport to an emulated board in this process, in virtual time. Waiting advances its clock.
pub struct Memory {
    board: Rc<RefCell<EmulatedBoard>>,
}

impl Memory {
    /// Creates a transport to `board`.
    pub fn new(board: Rc<RefCell<EmulatedBoard>>) -> Self {
        Self { board }
    }
}

impl Transport for Memory {
    fn name(&self) -> String {
        "memory".to_owned()
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.board.borrow().now().0)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.board.borrow_mut().write(bytes);
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let mut board = self.board.borrow_mut();
        let end = board.now().0 + wait.as_micros() as u64;
        // The board's time is whole ticks: a shorter wait is one, too.
        let end = Micros(end.next_multiple_of(u64::from(plumb_core::TICK_US)));
        board.run_until_bytes(end).map_err(SimulationError::from)?;
        bytes.append(&mut board.read());
        Ok(())
    }
}
