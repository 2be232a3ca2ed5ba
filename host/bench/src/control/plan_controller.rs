//! A controller that plays back a motion plan without feedback.

use nalgebra::Point3;
use plumb_protocol::PerMotor;
use plumb_protocol::units::Micros;

use super::simulate::Controller;
use super::suite::Clock;

/// Playback of a motion plan from the start of the clock.
pub(crate) struct PlanController {
    /// Motor positions, full steps; one row a millisecond.
    rows: Vec<PerMotor<f64>>,
    start: Option<Micros>,
    /// Time since the start, milliseconds.
    elapsed_ms: u64,
}

impl PlanController {
    /// Creates the playback of `rows`: motor positions in full steps, one row a millisecond.
    pub(crate) fn new(rows: Vec<PerMotor<f64>>, clock: Clock) -> Self {
        Self { rows, start: (clock == Clock::Target).then_some(Micros(0)), elapsed_ms: 0 }
    }
}

impl Controller for PlanController {
    fn on_position(&mut self, now: Micros, _: u32, _: Option<Point3<f64>>) {
        self.start.get_or_insert(now);
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        self.elapsed_ms = self.start.map_or(0, |start| now.since(start) / 1000);
        let row = self.rows.get(self.elapsed_ms as usize).or(self.rows.last());
        row.copied().unwrap_or_default()
    }

    fn reached(&self) -> bool {
        self.elapsed_ms >= self.rows.len() as u64
    }

    fn failed(&self) -> bool {
        false
    }
}
