//! Driving the ball to a target: what is seen of it, and what the law makes of that.

use plumb_protocol::units::{Micros, Point};

use crate::estimate::{self, Arrival, Divergence, Filter};
use crate::law::{Demand, Law, Picture, Quick};
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
    /// The law, where it is a quick one; made anew with each configuration.
    pub(super) law: Option<Quick>,
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
    /// The question to a slow law that is open.
    pub(super) question: Option<u32>,
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
            question: None,
            arrival: Arrival::default(),
            divergence: Divergence::default(),
        }
    }

    /// What the law wants now.
    pub(super) fn demand(&self, now: Micros) -> Demand {
        self.demand.after(now.since(self.asked))
    }

    /// When it took effect, and for how long it holds, µs.
    pub(super) fn lasts(&self) -> (Micros, u64) {
        (self.asked, self.demand.lasts_us.into())
    }

    /// Goes by `demand` from `now` on, within the motors' limits.
    pub(super) fn follow(&mut self, now: Micros, demand: Demand, params: &Params) {
        self.demand = Demand { rates: demand.rates.within(params.max_rates()), ..demand };
        self.asked = now;
    }

    /// Lets a quick law answer to what was just seen.
    pub(super) fn answer(&mut self, now: Micros, sight: &mut Sight, params: &Params) {
        if let (Some(law), Some(ball)) = (&mut sight.law, sight.last) {
            // These laws go by the ball alone.
            let (nowhere, target) = ([0; 3], self.target.micrometres());
            let picture = Picture {
                ball,
                variances: nowhere,
                then: nowhere,
                before: [nowhere; 2],
                ahead: nowhere,
                target,
            };
            let demand = law.update(&picture);
            self.follow(now, demand, params);
        }
    }

    /// Looks how things go after a picture; whether the error has kept growing for too long.
    pub(super) fn judge(&mut self, now: Micros, sight: &Sight, params: &Params) -> bool {
        let Some(filtered) = sight.filtered_error(self.target) else { return false };
        self.reached |= self.arrival.update(filtered, sight.filter.off(), &params.reached);
        self.divergence.update(now, filtered, &params.growth)
    }
}
