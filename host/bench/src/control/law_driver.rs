//! Laws in `f64` as drivers: what the board does between a picture and the motors, with another law
//! in it.

use nalgebra::Point3;
use plumb_core::MotorRates;
use plumb_core::estimate::{self, Arrival, Filter};
use plumb_core::law::{Law, Measurement, Setpoint, variances};
use plumb_core::law_worker::{LawClient, LawResponse};
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_protocol::config::Config;
use plumb_protocol::units::{Micros, Point, Steps16};

use super::simulate::Driver;

/// The board's planner, its history and its rules for late pictures, and any [`Law`]. With the
/// board's own law in it, it does what a board does, up to rounding.
pub(super) struct LawDriver {
    law: Box<dyn Law>,
    planner: Planner,
    params: Params,
    config: Config,
    max_rates: [i32; 3],
    target: Point,
    /// For a law that the board lets think, and the question that is open.
    law_client: LawClient,
    request: Option<u32>,
    filter: Filter,
    arrival: Arrival,
    reached: bool,
    /// When the last picture with a ball was taken, or the target was set.
    seen: Micros,
    /// Whether it has stopped because nothing was seen for too long.
    lost: bool,
    sent_on: bool,
    setpoint: Setpoint,
    asked: Micros,
    /// Whether the setpoint is a new one, and what the planner was told to aim at last.
    answered: bool,
    aimed: MotorRates,
}

impl LawDriver {
    /// `law` in a board of this configuration, from which `params` were made, that drives the ball
    /// to `target`.
    pub(super) fn new(
        law: Box<dyn Law>,
        (config, params): (Config, &Params),
        target: Point,
    ) -> Self {
        let mut planner = Planner::default();
        planner.configure(params);
        Self {
            law,
            planner,
            params: *params,
            config,
            max_rates: config.motors.map(|motor| motor.max_rate.0),
            target,
            law_client: LawClient::default(),
            request: None,
            filter: Filter::default(),
            arrival: Arrival::default(),
            reached: false,
            seen: Micros(0),
            lost: false,
            sent_on: false,
            setpoint: Setpoint::default(),
            asked: Micros(0),
            answered: false,
            aimed: MotorRates::default(),
        }
    }

    /// Goes on once it stands still and the ball is seen again, as the bench sends a board on.
    fn resume(&mut self, now: Micros) {
        if self.lost && !self.planner.moving() {
            (self.lost, self.sent_on) = (false, true);
            (self.arrival, self.setpoint, self.request) =
                (Arrival::default(), Setpoint::default(), None);
            self.seen = self.seen.max(now);
        }
    }

    /// Lets the law answer at once to a ball seen at `ball`, µm.
    fn response(&mut self, now: Micros, ball: [i32; 3]) {
        let (then, ahead) = (self.planner.positions(), self.planner.reference());
        let setpoint = self.law.update(&Measurement {
            ball,
            variances: variances(None),
            motors: then,
            motors_before: [then; 2],
            motors_ahead: ahead,
            target: self.target.micrometres(),
        });
        self.follow(now, setpoint);
    }

    fn follow(&mut self, now: Micros, setpoint: Setpoint) {
        self.setpoint = Setpoint { rates: setpoint.rates.within(self.max_rates), ..setpoint };
        (self.asked, self.answered) = (now, true);
    }

    /// Lets the law think about what was seen, after the tick at `now`.
    fn think(&mut self, now: Micros) {
        if self.lost {
            return self.law_client.discard_pending();
        }
        if let Some(number) =
            self.law_client.make_request(now, self.target, &self.planner, &self.params)
        {
            self.request = Some(number);
        }
        if let Some(request) = self.law_client.take_request() {
            let setpoint = self.law.update(&request.measurement);
            self.law_client.on_response(&LawResponse { number: request.number, setpoint });
        }
    }

    /// What is wanted of the motors at `now`.
    fn wanted(&mut self, now: Micros) -> Setpoint {
        let deadline_us = u64::from(self.config.deadlines.position.0) * 1000;
        self.lost |= now.since(self.seen) > deadline_us;
        if self.lost {
            return Setpoint::default();
        }
        let coasting = Micros(self.seen.0 + deadline_us * 2 / 5);
        if now > coasting {
            let setpoint = self.setpoint.after(coasting.since(self.asked));
            return Setpoint { rates: setpoint.rates.coasting(), ..setpoint };
        }
        self.setpoint.after(now.since(self.asked))
    }
}

impl Driver for LawDriver {
    fn see(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        let point = ball.and_then(|ball| Point::from_metres(ball.into()));
        let Some(point) = point.filter(|point| self.inside(*point)) else { return };
        self.resume(now);
        let ball = point.micrometres();
        let captured = now.back(u64::from(age_us));
        self.seen = self.seen.max(captured);
        self.filter.update(ball);
        if self.lost {
            return;
        }
        match self.params.deferred_law() {
            Some(_) => self.law_client.on_position(captured, ball, None),
            None => self.response(now, ball),
        }
        if let Some(filtered) = self.filter.position() {
            let distance = estimate::magnitude(estimate::error(filtered, self.target));
            self.reached |= self.arrival.update(distance, self.filter.off(), &self.config.reached);
        }
    }

    fn tick(&mut self, now: Micros) -> [f64; 3] {
        if let Some((number, Some(setpoint))) = self.law_client.take_due(now)
            && self.request == Some(number)
        {
            self.follow(now, setpoint);
        }
        let wanted = self.wanted(now);
        // A board aims anew where something has happened, which rounds less than to do so in every
        // tick.
        if self.answered || wanted.rates != self.aimed {
            self.planner.aim(wanted.rates, wanted.ramp_us);
            (self.answered, self.aimed) = (false, wanted.rates);
        }
        self.planner.tick();
        self.think(now);
        self.planner.positions().map(|p| Steps16(p).to_si())
    }

    fn reached(&self) -> bool {
        self.reached
    }

    fn failed(&self) -> bool {
        false
    }

    fn sent_on(&self) -> bool {
        self.sent_on
    }
}

impl LawDriver {
    /// Whether the board would take a ball at `point` for one.
    fn inside(&self, point: Point) -> bool {
        self.config.workspace.contains(point)
    }
}
