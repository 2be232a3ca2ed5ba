//! The drive along a path: its reference, and the errors and the aim that come from it.

use plumb_protocol::message::{Reference, ReferenceState};
use plumb_protocol::units::{Micrometres, Micros, Point};

use super::reference::{Aim, Follower};
use super::{Servo, coasting_us, error, limit_us, magnitude};
use crate::law::Law;
use crate::params::Params;
use crate::plan::mean_lag_us;

/// Time that a drive along a path stands still without a position before it is given up, µs.
/// People walk through a camera's view.
const PATIENCE_US: u64 = 2_000_000;

/// Returns the aim of a law whose rates take effect at `time`: of a drive that follows, or of one
/// to `target`.
pub(super) fn aim(
    follower: Option<&Follower>,
    target: Point,
    time: Micros,
    params: &Params,
) -> Aim {
    follower.map_or(Aim::at(target), |follower| follower.aim(time, params))
}

impl<L: Law> Servo<L> {
    /// Follows a path from `start` on, where the reference begins at rest.
    pub fn follow(&mut self, now: Micros, start: Point, reference: &Reference) {
        self.follower = Some(Follower::new(now, start.micrometres(), reference));
    }

    /// Takes over the next part of the path, where it is newer than the last one. Returns whether
    /// it is; `None` while the drive follows no path.
    pub fn follow_on(&mut self, now: Micros, reference: &Reference) -> Option<bool> {
        self.follower.as_mut().map(|follower| follower.update(now, reference))
    }

    /// Ends the following where the path has ended. Returns the path's end; `None` where the drive
    /// follows none.
    pub(crate) fn end_following(&mut self) -> Option<Point> {
        self.follower.take().map(|follower| follower.last())
    }

    /// Returns when the reference needs its next step; `None` while the drive follows none.
    pub(crate) fn next_reference_step(&self, params: &Params) -> Option<Micros> {
        self.follower.as_ref().map(|follower| follower.next_step(mean_lag_us(params.mean_ms)))
    }

    /// Makes a part of the next state of the reference, where it is due at `now`. Call in every
    /// tick, before [`make_request`](Self::make_request). `is_busy`: the tick has other work, and
    /// the state waits if it can. Returns the position of the reference at `now`; `None` while the
    /// drive follows none.
    pub fn advance_reference(
        &mut self,
        now: Micros,
        is_busy: bool,
        params: &Params,
    ) -> Option<Point> {
        let is_due = self.next_reference_step(params)? <= now;
        let is_seen = now.since(self.last_seen()) <= coasting_us(params.deadlines.position);
        let filtered = self.tracker.filtered().filter(|_| is_seen);
        let follower = self.follower.as_mut()?;
        if is_due && (!is_busy || follower.is_late(now, mean_lag_us(params.mean_ms))) {
            let deviation = filtered.map(|ball| magnitude(error(ball, follower.smoothed())));
            follower.step(now, deviation, params);
        }
        Some(Point(follower.position(now).map(Micrometres)))
    }

    /// Returns the state of the reference for telemetry; `None` while the drive follows none.
    pub fn reference_state(&self, now: Micros) -> Option<ReferenceState> {
        self.follower.as_ref().map(|follower| follower.state(now))
    }

    /// Returns the last error and the filtered one of a drive to `target`, µm. Where the drive
    /// follows a reference, the errors are from where that was at the captures.
    pub(crate) fn errors(&self, target: Point) -> ([i32; 3], u32) {
        let (last, filtered) = match &self.follower {
            Some(follower) => {
                (Point(follower.position(self.last_seen()).map(Micrometres)), follower.smoothed())
            }
            None => (target, target),
        };
        (
            self.tracker.last().map_or([0; 3], |ball| error(ball, last)),
            self.tracker.filtered().map_or(0, |ball| magnitude(error(ball, filtered))),
        )
    }

    /// Returns the longest time without a position before the drive is given up, µs: their
    /// deadline, and more along a path, which waits at standstill.
    pub(crate) fn patience_us(&self, params: &Params) -> u64 {
        let deadline = limit_us(params.deadlines.position);
        if self.follower.is_some() { deadline + PATIENCE_US } else { deadline }
    }
}
