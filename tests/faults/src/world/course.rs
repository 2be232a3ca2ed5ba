//! The course of a run from its first fault on.

use nalgebra::Point3;
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Micros;

use super::machine::Machine;
use crate::cause::fault_of;

/// What happened from the first fault on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Course {
    /// The onset: the start of the fault, or of the first turn of a motor for a fault of the
    /// wiring.
    pub began: Option<Micros>,
    /// Place of the ball at the onset, m.
    start: Point3<f64>,
    /// Present target, m.
    target: Option<Point3<f64>>,
    /// Place of the ball since the onset that is nearest to the present target, m.
    nearest: Option<Point3<f64>>,
    /// Farthest that the ball was from its place at the onset while motors turned, m.
    pub moved_m: f64,
    /// Largest growth of the distance from the present target above that of the nearest place while
    /// motors turned, m.
    pub away_m: f64,
    /// First fault of the board, and its time.
    pub fault: Option<(Micros, Fault)>,
    /// First time at which the board drives no more: it stops, is in a fault or has restarted.
    pub reacted: Option<Micros>,
    /// First time after the reaction at which the motors stood.
    stood: Option<Micros>,
}

impl Course {
    /// Sets the present target, m.
    pub fn set_target(&mut self, target: Point3<f64>) {
        (self.target, self.nearest) = (Some(target), None);
    }

    /// Sets the present place of a target that moves, m.
    pub fn move_target(&mut self, target: Point3<f64>) {
        self.target = Some(target);
    }

    /// Returns when the motors stood after the reaction at `reacted`.
    pub fn stood(&self, reacted: Micros) -> Micros {
        self.stood.unwrap_or(reacted).max(reacted)
    }

    /// Takes in the tick that has ended. A fault of the wiring has its onset at the first turn.
    pub(super) fn note(&mut self, board: &dyn Machine, from_start: bool) {
        let (now, ball, rests) = (board.now(), board.ball(), board.is_at_rest());
        if self.began.is_none() {
            if from_start && rests {
                return;
            }
            (self.began, self.start, self.nearest) = (Some(now), ball, None);
        }
        if !matches!(board.state(), State::Seeking | State::Holding | State::Following) {
            self.reacted.get_or_insert(now);
        }
        if self.fault.is_none() {
            self.fault = fault_of(board.state()).map(|fault| (now, fault));
        }
        if self.reacted.is_some() && rests {
            self.stood.get_or_insert(now);
        }
        if self.stood.is_none() {
            self.measure(ball, rests);
        }
    }

    /// Measures how far the ball is from its place at the onset and from its target.
    fn measure(&mut self, ball: Point3<f64>, rests: bool) {
        let Some(target) = self.target else { return };
        let error_m = |place: Point3<f64>| (place - target).norm();
        let nearest = self.nearest.filter(|place| error_m(*place) < error_m(ball)).unwrap_or(ball);
        self.nearest = Some(nearest);
        if !rests {
            self.away_m = self.away_m.max(error_m(ball) - error_m(nearest));
            self.moved_m = self.moved_m.max((ball - self.start).norm());
        }
    }
}
