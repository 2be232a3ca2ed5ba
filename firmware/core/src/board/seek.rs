//! Driving the ball to a target: what is seen of it, and what the law makes of that.

use plumb_protocol::units::{Micros, Point};

use crate::estimate::{self, Arrival, Divergence, Filter};
use crate::law::MotorRates;
use crate::params::Params;

/// What the board knows of the ball.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sight {
    /// Number of the last picture that was accepted.
    pub(super) sequence: Option<u16>,
    /// When the last picture with the ball inside the workspace was taken.
    pub(super) captured: Option<Micros>,
    /// Where the ball was in it, µm.
    pub(super) last: Option<[i32; 3]>,
    /// Pictures in a row that showed the ball outside the workspace.
    pub(super) outside: u8,
    /// The filter over all of them.
    pub(super) filter: Filter,
}

impl Sight {
    /// Takes in a position inside the workspace.
    pub(super) fn saw(&mut self, captured: Micros, ball: [i32; 3]) {
        self.captured = Some(captured);
        self.last = Some(ball);
        self.outside = 0;
        self.filter.update(ball);
    }

    /// The filtered position, µm.
    pub(super) fn filtered(&self) -> Option<[i32; 3]> {
        self.filter.position()
    }

    /// |e| of the filtered position, µm.
    pub(super) fn filtered_error(&self, target: Point) -> Option<u32> {
        self.filtered().map(|p| estimate::magnitude(estimate::error(p, target)))
    }
}

/// A target and how things go with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seek {
    pub(super) target: Point,
    /// When it was set.
    pub(super) since: Micros,
    /// Whether it was reached once.
    pub(super) reached: bool,
    /// What the law asked for last.
    pub(super) rates: MotorRates,
    arrival: Arrival,
    divergence: Divergence,
}

impl Seek {
    pub(super) fn new(target: Point, since: Micros, reached: bool) -> Self {
        Self {
            target,
            since,
            reached,
            rates: MotorRates::default(),
            arrival: Arrival::default(),
            divergence: Divergence::default(),
        }
    }

    /// Lets the law answer to what was just seen; whether the error has kept growing for too long.
    pub(super) fn update(&mut self, now: Micros, sight: &Sight, params: &Params) -> bool {
        let (Some(last), Some(filtered)) = (sight.last, sight.filtered_error(self.target)) else {
            return false;
        };
        let e = estimate::error(last, self.target);
        self.rates = params.law.rates(e).within(params.max_rates());
        self.reached |= self.arrival.update(filtered, &params.reached);
        self.divergence.update(now, filtered, &params.growth)
    }
}
