//! The world of a run: board, rig, link and clock, one tick after the other.

mod camera;
mod channel;
mod course;
mod port;
mod power;
mod rig;
mod witness;

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::Point3;
use plumb_core::TICK_US;
use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;

pub use camera::FaultyCamera;
pub use course::Course;
pub use port::Port;

use crate::plan::Plan;
use channel::Channel;
use power::Power;
use rig::FaultyRig;
use witness::Witness;

/// A world that host, link and camera share.
pub type Shared = Rc<RefCell<World>>;

/// Board, rig, link and clock.
pub struct World {
    plan: Plan,
    board: EmulatedBoard,
    witness: Witness,
    power: Power,
    to_board: Channel,
    to_host: Channel,
    /// Bytes that have arrived at the host.
    arrived: Vec<u8>,
    course: Course,
    /// Whether the course has ended: later ticks do not count.
    is_closed: bool,
}

impl World {
    /// Returns the world of a plan. Its clock begins at 0, with the motors at rest.
    pub fn new(plan: &Plan) -> Self {
        let board = EmulatedBoard::with_plant(EMULATED, Box::new(FaultyRig::new(plan)));
        Self {
            witness: Witness::new(plan.seed, &board),
            power: Power::new(plan),
            board,
            to_board: Channel::new(plan, 0),
            to_host: Channel::new(plan, 1),
            arrived: Vec::new(),
            course: Course::default(),
            is_closed: false,
            plan: plan.clone(),
        }
    }

    /// Returns the clock.
    pub fn now(&self) -> Micros {
        self.board.now()
    }

    /// Returns the place of the ball, m.
    pub fn ball(&self) -> Point3<f64> {
        self.board.ball().unwrap_or_else(Point3::origin)
    }

    /// Returns the state of the board.
    pub fn state(&self) -> State {
        self.board.state()
    }

    /// Returns whether no motor turns.
    pub fn is_at_rest(&self) -> bool {
        self.board.rates() == [0.0; 3]
    }

    /// Sets the target from which the course measures, m.
    pub fn set_target(&mut self, target: Point3<f64>) {
        self.course.set_target(target);
    }

    /// Returns what happened from the first fault on.
    pub fn course(&self) -> Course {
        self.course
    }

    /// Ends the course.
    pub fn close(&mut self) {
        self.is_closed = true;
    }

    /// Returns the broken invariants so far.
    pub fn violations(&self) -> Vec<String> {
        self.witness.violations()
    }

    /// Runs a tick: the frames that are due arrive, then the board runs.
    pub fn tick(&mut self) {
        let now = self.now();
        let reports = self.power.act(&mut self.board, &mut self.witness);
        self.to_host.send(now, &reports);
        for frame in self.to_board.receive(now) {
            let replies = self.witness.deliver(&mut self.board, &frame);
            self.to_host.send(now, &replies);
        }
        let replies = self.witness.tick(&mut self.board, self.power.inputs(now));
        self.to_host.send(now, &replies);
        for frame in self.to_host.receive(self.now()) {
            self.arrived.extend(frame);
        }
        if !self.is_closed && now >= self.plan.onset() {
            self.course.note(&self.board, self.plan.onset() == Micros(0));
        }
    }

    /// Runs to `end`.
    pub fn run_to(&mut self, end: Micros) {
        while self.now().0 + u64::from(TICK_US) <= end.0 {
            self.tick();
        }
    }
}
