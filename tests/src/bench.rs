//! A host without a camera before an emulated board in virtual time: what a test sees is what the rig does.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use nalgebra::Point3;
use plumb::link::{Link, LinkError, Memory, Transport};
use plumb::rig::Rig;
use plumb_emulator::rig::Plant;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::message::State;
use plumb_protocol::units::{Micros, Point};

/// Pictures a second.
pub const RATE_HZ: u64 = 30;

/// A greeted and configured board with a rig.
pub struct Bench<T> {
    /// The board, shared with the link.
    pub board: Rc<RefCell<EmulatedBoard>>,
    /// The link.
    pub link: Link<T>,
    frame: u64,
    start: Micros,
}

/// A board on a perfect link.
///
/// # Errors
/// Where the board does not take the configuration.
pub fn bench(rig: &Rig, plant: Box<dyn Plant + Send>) -> Result<Bench<Memory>, LinkError> {
    bench_over(rig, plant, |memory| memory)
}

/// A board on the link that `wrap` makes of the perfect one.
///
/// # Errors
/// Where the board does not take the configuration.
///
/// # Panics
/// Where the rig file says what the board cannot be told.
pub fn bench_over<T: Transport>(
    rig: &Rig,
    plant: Box<dyn Plant + Send>,
    wrap: impl FnOnce(Memory) -> T,
) -> Result<Bench<T>, LinkError> {
    let board = Rc::new(RefCell::new(EmulatedBoard::with_plant(EMULATED, plant)));
    let mut link = Link::greet(wrap(Memory::new(Rc::clone(&board))))?;
    link.configure(rig.config().expect("a rig file that fits the board"))?;
    let start = board.borrow().now();
    Ok(Bench { board, link, frame: 0, start })
}

impl<T: Transport> Bench<T> {
    /// Where the rig's ball is, metres.
    pub fn ball(&self) -> Point3<f64> {
        self.board.borrow().ball().unwrap_or_else(Point3::origin)
    }

    /// The board's state.
    pub fn state(&self) -> State {
        self.board.borrow().state()
    }

    /// Reports the ball as `seen` makes it of where it is, and lets the board's time pass to the next picture.
    ///
    /// # Errors
    /// Where the link fails, or the rig cannot follow.
    pub fn frame(&mut self, seen: impl FnOnce(Point3<f64>) -> Option<Point3<f64>>) -> Result<(), LinkError> {
        let ball = seen(self.ball()).and_then(|p| Point::from_metres(p.into()));
        self.link.position(ball, None, Duration::ZERO)?;
        self.frame += 1;
        let next = Micros(self.start.0 + self.frame * 1_000_000 / RATE_HZ);
        self.board.borrow_mut().run_to(next)?;
        self.link.poll()
    }
}
