//! A host without a camera before an emulated board in virtual time: what a test sees is what the
//! rig does.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use nalgebra::Point3;
use plumb::memory::Memory;
use plumb::source::simulated::SimulationError;
use plumb_emulator::rig::Plant;
use plumb_emulator::{EMULATED, EmulatedBoard, Wire};
use plumb_protocol::message::State;
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;

/// Pictures a second.
pub const RATE_HZ: u64 = 30;

/// A greeted and configured board with a rig.
pub struct Bench {
    /// The board, shared with the link.
    pub board: Rc<RefCell<EmulatedBoard>>,
    /// The link.
    pub link: Link<Memory>,
    frame: u64,
    start: Micros,
}

/// A board behind `wire`.
///
/// # Errors
/// Where the board does not take the configuration.
///
/// # Panics
/// Where the rig file says what the board cannot be told.
pub fn bench(rig: &Rig, plant: Box<dyn Plant + Send>, wire: Wire) -> Result<Bench, LinkError> {
    let board = EmulatedBoard::with_plant(EMULATED, plant).with_wire(wire);
    let board = Rc::new(RefCell::new(board));
    let mut link = Link::greet(Memory::new(Rc::clone(&board)))?;
    link.configure(rig.config().expect("a rig file that fits the board"))?;
    let start = board.borrow().now();
    Ok(Bench { board, link, frame: 0, start })
}

impl Bench {
    /// Where the rig's ball is, metres.
    pub fn ball(&self) -> Point3<f64> {
        self.board.borrow().ball().unwrap_or_else(Point3::origin)
    }

    /// The board's state.
    pub fn state(&self) -> State {
        self.board.borrow().state()
    }

    /// Reports the ball as `seen` makes it of where it is, and lets the board's time pass to the
    /// next picture.
    ///
    /// # Errors
    /// Where the link fails, or the rig cannot follow.
    pub fn frame(
        &mut self,
        seen: impl FnOnce(Point3<f64>) -> Option<Point3<f64>>,
    ) -> Result<(), LinkError> {
        let ball = seen(self.ball()).and_then(|p| Point::from_metres(p.into()));
        self.link.position(ball, None, Duration::ZERO)?;
        self.frame += 1;
        let next = Micros(self.start.0 + self.frame * 1_000_000 / RATE_HZ);
        self.board.borrow_mut().run_to(next).map_err(SimulationError::from)?;
        self.link.poll()
    }
}
