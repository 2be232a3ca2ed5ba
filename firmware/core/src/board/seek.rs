//! Driving the ball to a target: what is seen of it, and what the law makes of that.

use plumb_protocol::units::{Micros, Point};

use crate::estimate::{self, Arrival, Divergence, Filter};
use crate::law::{InlineLaw, Law, Measurement, Setpoint};
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
    pub(super) law: Option<InlineLaw>,
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
    /// Id of the command that set it; `None` where that was of an earlier session.
    pub(super) command: Option<u16>,
    /// Whether it was reached once.
    pub(super) reached: bool,
    /// What the law asked for last, and when.
    setpoint: Setpoint,
    asked: Micros,
    /// The question to a slow law that is open.
    pub(super) question: Option<u32>,
    arrival: Arrival,
}

/// Guards of a drive from target to target: a change of the target leaves them as they are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guards {
    /// When the drive began.
    pub(super) since: Micros,
    divergence: Divergence,
}

impl Guards {
    /// Creates the guards of a drive that begins at `since`.
    pub(super) fn new(since: Micros) -> Self {
        Self { since, divergence: Divergence::default() }
    }

    /// Begins another drive while motors may still turn from the last one: the ball is still
    /// watched as before.
    pub(super) fn resume(&mut self, now: Micros) {
        self.since = now;
    }

    /// Checks after a picture whether the ball has been driven away from its target for too long:
    /// `filtered` is its filtered position, `error` the distance from `target`, µm.
    pub(super) fn diverges(
        &mut self,
        now: Micros,
        filtered: [i32; 3],
        error: u32,
        target: Point,
        params: &Params,
    ) -> bool {
        self.divergence.update(now, filtered, error, target, &params.growth)
    }
}

impl Seek {
    /// A target that `command` has set at `now`.
    pub(super) fn new(target: Point, command: u16, now: Micros, reached: bool) -> Self {
        Self {
            target,
            command: Some(command),
            reached,
            setpoint: Setpoint::default(),
            asked: now,
            question: None,
            arrival: Arrival::default(),
        }
    }

    /// What the law wants now.
    pub(super) fn setpoint(&self, now: Micros) -> Setpoint {
        self.setpoint.after(now.since(self.asked))
    }

    /// When it took effect, and for how long it holds, µs.
    pub(super) fn lasts(&self) -> (Micros, u64) {
        (self.asked, self.setpoint.valid_us.into())
    }

    /// Goes by `setpoint` from `now` on, within the motors' limits.
    pub(super) fn follow(&mut self, now: Micros, setpoint: Setpoint, params: &Params) {
        self.setpoint = Setpoint { rates: setpoint.rates.within(params.max_rates()), ..setpoint };
        self.asked = now;
    }

    /// Lets a quick law answer to what was just seen.
    pub(super) fn answer(&mut self, now: Micros, sight: &mut Sight, params: &Params) {
        if let (Some(law), Some(ball)) = (&mut sight.law, sight.last) {
            // These laws go by the ball alone.
            let (nowhere, target) = ([0; 3], self.target.micrometres());
            let picture = Measurement {
                ball,
                variances: nowhere,
                motors: nowhere,
                motors_before: [nowhere; 2],
                motors_ahead: nowhere,
                target,
            };
            let setpoint = law.update(&picture);
            self.follow(now, setpoint, params);
        }
    }

    /// Notes after a picture whether the target is reached: `error` is the distance of the filtered
    /// position, µm.
    pub(super) fn note_arrival(&mut self, error: u32, sight: &Sight, params: &Params) {
        self.reached |= self.arrival.update(error, sight.filter.off(), &params.reached);
    }
}
