//! Clocks of simulated rigs: virtual time and real time.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_emulator::plant::RigError;
use plumb_emulator::{EmulatedBoard, Pace, Served};
use plumb_frame::clock::LiveClock;
use plumb_protocol::PerMotor;
use plumb_protocol::units::Micros;

use crate::led_port::LedPort;

/// Ball of a simulated rig at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Centre of the ball, metres, rig frame.
    pub ball: Point3<f64>,
    /// See [`SimClock::tensions_per_weight`].
    pub tensions: Option<PerMotor<f64>>,
}

/// The clock of a simulated rig, and the position of its ball.
pub trait SimClock {
    /// Returns the time, seconds.
    fn now(&self) -> f64;

    /// Waits until `time`, seconds. Returns at once if it has passed.
    ///
    /// # Errors
    /// If the rig cannot follow its motors.
    fn wait_until(&mut self, time: f64) -> Result<(), RigError>;

    /// Returns the present centre of the ball, metres, rig frame.
    fn ball(&self) -> Point3<f64>;

    /// Returns the present tension of each cable over the ball's weight, order A, B, C; `None` for
    /// a rig without forces.
    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        None
    }

    /// Returns the ball at `time`, seconds, which has passed, and is no earlier than at the last
    /// call. `None` for a rig that knew its ball at that time.
    ///
    /// # Errors
    /// If the rig cannot follow its motors.
    fn seen_at(&self, _time: f64) -> Result<Option<Seen>, RigError> {
        Ok(None)
    }

    /// Returns the clock of [`now`](Self::now) for other threads; `None` in virtual time.
    fn live_clock(&self) -> Option<LiveClock> {
        None
    }
}

/// The rig of a [`VirtualBoard`](super::VirtualBoard), on the board's clock.
pub struct VirtualRig {
    pub(super) board: Rc<RefCell<EmulatedBoard>>,
    /// Whether its time is no faster than real time.
    pub(super) is_paced: bool,
    /// Pace of its time from the first wait on.
    pub(super) pace: Option<Pace>,
}

impl SimClock for VirtualRig {
    fn now(&self) -> f64 {
        self.board.borrow().now().0 as f64 * 1e-6
    }

    fn wait_until(&mut self, time: f64) -> Result<(), RigError> {
        if self.is_paced {
            let pace = self.pace.get_or_insert_with(|| Pace::begin(1.0));
            let left = time - self.board.borrow().now().0 as f64 * 1e-6;
            pace.wait(Duration::from_secs_f64(left.max(0.0)));
        }
        self.board.borrow_mut().run_to(Micros((time * 1e6) as u64))
    }

    fn ball(&self) -> Point3<f64> {
        self.board.borrow().ball().unwrap_or_else(Point3::origin)
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        self.board.borrow().tensions_per_weight()
    }
}

/// Ball of a rig that moves in real time.
pub trait RealTimeBall {
    /// See [`SimClock::seen_at`].
    ///
    /// # Errors
    /// If the rig cannot follow its motors.
    fn seen_at(&self, _time: f64) -> Result<Option<Seen>, RigError> {
        Ok(None)
    }

    /// Returns the present centre of the ball, metres, rig frame.
    fn ball(&self) -> Point3<f64>;

    /// See [`SimClock::tensions_per_weight`].
    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        None
    }
}

/// Rig in real time, on a clock that begins with it, or on the clock of its board.
pub struct RealTimeRig<B> {
    pub(super) ball: B,
    pub(super) clock: RigClock,
}

/// Rig of an emulated board in another thread, in real time.
pub type ServedRig = RealTimeRig<Arc<Served>>;

impl ServedRig {
    /// Returns the rig of the served board; `None` if it has none.
    pub fn new(served: Arc<Served>) -> Option<Self> {
        served.board().ball()?;
        Some(Self { ball: served, clock: RigClock::start() })
    }
}

impl RealTimeBall for Arc<Served> {
    fn ball(&self) -> Point3<f64> {
        self.board().ball().unwrap_or_else(Point3::origin)
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        self.board().tensions_per_weight()
    }
}

impl<B: RealTimeBall> SimClock for RealTimeRig<B> {
    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn wait_until(&mut self, time: f64) -> Result<(), RigError> {
        self.clock.wait_until(time);
        Ok(())
    }

    fn seen_at(&self, time: f64) -> Result<Option<Seen>, RigError> {
        self.ball.seen_at(time)
    }

    fn ball(&self) -> Point3<f64> {
        self.ball.ball()
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        self.ball.tensions_per_weight()
    }

    fn live_clock(&self) -> Option<LiveClock> {
        match self.clock {
            RigClock::Real(start) => Some(LiveClock::since(start)),
            RigClock::Led(_) => None,
        }
    }
}

/// Clock of a rig whose board is in another program, or real.
#[derive(Debug, Clone)]
pub(super) enum RigClock {
    /// Real time since the start.
    Real(Instant),
    /// That of an emulated board, which waits for this program.
    Led(LedPort),
}

impl RigClock {
    /// Starts a clock in real time.
    pub(super) fn start() -> Self {
        Self::Real(Instant::now())
    }

    pub(super) fn now(&self) -> f64 {
        match self {
            Self::Real(start) => start.elapsed().as_secs_f64(),
            Self::Led(port) => port.seconds(),
        }
    }

    pub(super) fn wait_until(&self, time: f64) {
        match (self, Duration::try_from_secs_f64(time)) {
            (Self::Real(start), Ok(span)) => {
                thread::sleep((*start + span).saturating_duration_since(Instant::now()));
            }
            (Self::Led(port), _) if time > port.seconds() => port.run_to(time),
            _ => {}
        }
    }
}
