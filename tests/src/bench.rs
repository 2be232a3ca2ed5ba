//! A link to an emulated board in virtual time, without a camera: tests report the position of the
//! simulated ball.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use nalgebra::Point3;
use plumb_emulator::plant::Plant;
use plumb_emulator::{EMULATED, EmulatedBoard, Wire};
use plumb_protocol::message::State;
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_sim::memory::Memory;
use plumb_sim::simulated::SimulationError;

/// Rate of the positions, 1/s.
pub const RATE_HZ: u64 = 30;

/// Gain of law `interval`, 1/s: that of the benchmarks.
const GAMMA: f64 = 450.0;

/// Returns the paper's rig file with this law, the widest travel and workspace, and a guard against
/// a growing error that fits the rigs of the population.
///
/// # Panics
/// If a value is out of the rig file's range.
pub fn wide_rig(law: LawName) -> Rig {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law = LawSettings::from(law);
    if law == LawName::Interval {
        rig.law.set_gamma(GAMMA).expect("a gain");
    }
    rig.motors.travel = [-60_000.0, 60_000.0].map(|t| t.try_into().expect("a travel"));
    rig.workspace.min = [-4.0; 3].map(|c| c.try_into().expect("a corner"));
    rig.workspace.max = [4.0; 3].map(|c| c.try_into().expect("a corner"));
    rig.growth.margin = 0.06.try_into().expect("a margin");
    rig.growth.time = 0.6.try_into().expect("a time");
    rig
}

/// A connected and configured board with a rig.
pub struct Bench {
    /// The board, shared with the link.
    pub board: Rc<RefCell<EmulatedBoard>>,
    /// The link.
    pub link: Link<Memory>,
    frame: u64,
    start: Micros,
}

/// Connects to a board behind `wire` and configures it.
///
/// # Errors
/// [`LinkError`] if the board refuses the configuration.
///
/// # Panics
/// If a value of the rig file is out of the wire's range.
pub fn bench(rig: &Rig, plant: Box<dyn Plant + Send>, wire: Wire) -> Result<Bench, LinkError> {
    let board = EmulatedBoard::with_plant(EMULATED, plant).with_wire(wire);
    let board = Rc::new(RefCell::new(board));
    let mut link = Link::connect(Memory::new(Rc::clone(&board)))?;
    link.configure(
        rig.wiring().expect("a wiring"),
        rig.config().expect("a rig file that fits the board"),
    )?;
    let start = board.borrow().now();
    Ok(Bench { board, link, frame: 0, start })
}

impl Bench {
    /// Returns the position of the rig's ball, m.
    pub fn ball(&self) -> Point3<f64> {
        self.board.borrow().ball().unwrap_or_else(Point3::origin)
    }

    /// Returns the board's state.
    pub fn state(&self) -> State {
        self.board.borrow().state()
    }

    /// Sends the position that `measure` makes of the ball's true one, and runs the board until the
    /// next frame.
    ///
    /// # Errors
    /// [`LinkError`] if the link fails or the rig cannot follow.
    pub fn frame(
        &mut self,
        measure: impl FnOnce(Point3<f64>) -> Option<Point3<f64>>,
    ) -> Result<(), LinkError> {
        let ball = measure(self.ball());
        self.report(ball, Duration::ZERO)
    }

    /// Sends a position of this age, and runs the board until the next frame.
    ///
    /// # Errors
    /// [`LinkError`] if the link fails or the rig cannot follow.
    pub fn report(&mut self, ball: Option<Point3<f64>>, age: Duration) -> Result<(), LinkError> {
        let ball = ball.and_then(|p| Point::from_metres(p.into()));
        self.link.position(ball, None, age)?;
        self.frame += 1;
        let next = Micros(self.start.0 + self.frame * 1_000_000 / RATE_HZ);
        self.board.borrow_mut().run_to(next).map_err(SimulationError::from)?;
        self.link.poll()
    }
}
