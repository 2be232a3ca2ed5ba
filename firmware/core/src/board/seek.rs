//! Driving the ball to a target: what is seen of it, and what the law makes of that.

use plumb_protocol::units::{Micros, Point};

use crate::estimate::{self, Arrival, Divergence, Filter};
use crate::law::{Controller, Demand, Law, Picture};
use crate::params::Params;
use crate::plan::Planner;

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
    /// The law with what it has learnt; made at the first picture of a target.
    pub(super) law: Option<Controller>,
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
    /// What the law asked for last, and when.
    demand: Demand,
    asked: Micros,
    arrival: Arrival,
    divergence: Divergence,
}

impl Seek {
    pub(super) fn new(target: Point, since: Micros, reached: bool) -> Self {
        Self {
            target,
            since,
            reached,
            demand: Demand::default(),
            asked: since,
            arrival: Arrival::default(),
            divergence: Divergence::default(),
        }
    }

    /// What the law wants now: its rates, and how long the change to them is still to take, µs.
    pub(super) fn demand(&self, now: Micros) -> Demand {
        let gone = now.since(self.asked).min(u64::from(u32::MAX)) as u32;
        Demand { ramp_us: self.demand.ramp_us.saturating_sub(gone), ..self.demand }
    }

    /// Lets the law answer to what was just seen, `age_us` old; whether the error has kept growing for too long.
    pub(super) fn update(
        &mut self,
        now: Micros,
        age_us: u32,
        sight: &mut Sight,
        planner: &Planner,
        params: &Params,
    ) -> bool {
        let (Some(ball), Some(filtered)) = (sight.last, sight.filtered_error(self.target)) else {
            return false;
        };
        // The others go by the picture alone, and these cost the chip a tenth of a tick.
        let learns = params.learns();
        let picture = Picture {
            ball,
            then: if learns {
                planner.positions_ago(age_us.saturating_add(params.delay_us()))
            } else {
                [0; 3]
            },
            ahead: if learns { planner.reference() } else { [0; 3] },
            target: self.target.micrometres(),
        };
        let demand = sight.law.get_or_insert_with(|| params.law()).update(&picture);
        self.demand = Demand { rates: demand.rates.within(params.max_rates()), ..demand };
        self.asked = now;
        self.reached |= self.arrival.update(filtered, &params.reached);
        self.divergence.update(now, filtered, &params.growth)
    }
}
