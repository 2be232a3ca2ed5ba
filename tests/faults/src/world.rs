//! The world of a run: board, rig, link and clock, one tick after the other.

mod camera;
mod channel;
mod chip;
mod course;
mod emulated;
mod machine;
mod port;
mod power;
mod rig;
mod witness;

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use nalgebra::Point3;
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;

use crate::plan::Plan;
use channel::Channel;
use chip::ChipMachine;
use emulated::Emulated;
use machine::Machine;

pub use camera::FaultyCamera;
pub use course::Course;
pub use port::Port;

/// A world that host, link and camera share.
pub type Shared = Rc<RefCell<World>>;

/// Board, rig, link and clock.
pub struct World {
    plan: Plan,
    machine: Box<dyn Machine>,
    to_board: Channel,
    to_host: Channel,
    /// Bytes that have arrived at the host.
    arrived: Vec<u8>,
    course: Course,
    /// Whether the course has ended: later ticks do not count.
    is_closed: bool,
}

impl World {
    /// Returns the world of a plan with an emulated board. Its clock begins at 0, with the motors
    /// at rest.
    pub fn emulated(plan: &Plan) -> Self {
        Self::with(plan, Box::new(Emulated::new(plan)))
    }

    /// Returns the world of a plan with the firmware `image` in the emulated chip.
    pub fn chip(plan: &Plan, image: &Path) -> Self {
        Self::with(plan, Box::new(ChipMachine::start(plan, image)))
    }

    fn with(plan: &Plan, machine: Box<dyn Machine>) -> Self {
        Self {
            machine,
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
        self.machine.now()
    }

    /// Returns the place of the ball, m.
    pub fn ball(&self) -> Point3<f64> {
        self.machine.ball()
    }

    /// Returns the state of the board.
    pub fn state(&self) -> State {
        self.machine.state()
    }

    /// Returns whether no motor turns.
    pub fn is_at_rest(&self) -> bool {
        self.machine.is_at_rest()
    }

    /// Sets the target from which the course measures, m.
    pub fn set_target(&mut self, target: Point3<f64>) {
        self.course.set_target(target);
    }

    /// Sets the present place of a target that moves, m.
    pub fn move_target(&mut self, target: Point3<f64>) {
        self.course.move_target(target);
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
        self.machine.violations()
    }

    /// Runs a tick: the frames that are due arrive, then the board runs.
    pub fn tick(&mut self) {
        let now = self.now();
        let frames = self.to_board.receive(now);
        let sent = self.machine.tick(&frames);
        self.to_host.send(now, &sent);
        for frame in self.to_host.receive(self.now()) {
            self.arrived.extend(frame);
        }
        if !self.is_closed && now >= self.plan.onset() {
            self.course.note(&*self.machine, self.plan.onset() == Micros(0));
        }
    }

    /// Runs to `end`, to the tick.
    pub fn run_to(&mut self, end: Micros) {
        while self.now() < end {
            self.tick();
        }
    }
}
