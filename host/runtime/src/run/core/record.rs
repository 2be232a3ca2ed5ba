//! The record of a frame, and the counts of a run.

use std::sync::Arc;

use plumb_protocol::message::State;

use super::{Action, RunCore};
use crate::board_report::BoardReport;
use crate::link::LinkView;
use crate::observer::FrameRecord;

impl RunCore {
    /// Records the frame of this round, where it has one. A frame that could not be searched counts
    /// as lost after that.
    pub(super) fn record(&mut self, view: LinkView) {
        self.board = view;
        let Some(picture) = &self.picture else { return };
        let (frame, observation) = (Arc::clone(&picture.frame), picture.ball);
        let is_located = picture.point().is_some();
        let ball = picture.position().map(|position| position.mean);
        self.last_position = ball.or(self.last_position);
        let path = self.path_point(frame.time(), ball);
        let filtered_error = self.filtered_error();
        let state = self.board.about_target().map(|telemetry| telemetry.state);
        let stats = &mut self.stats;
        stats.time = frame.time() - *stats.start.get_or_insert(frame.time());
        stats.located += u64::from(is_located);
        if matches!(state, Some(State::Seeking | State::Holding)) {
            stats.error = filtered_error.or(stats.error);
        }
        let record = FrameRecord {
            number: stats.frames,
            time: stats.time,
            observation,
            target: path.map(|path| path.position).or(self.target),
            board: self.board.telemetry.as_ref().map(|telemetry| BoardReport {
                drivers: self.board.drivers,
                ..BoardReport::from(telemetry)
            }),
            fault_cause: self.board.fault.and_then(|it| it.cause),
            state,
            filtered_error,
            ground_truth: frame.ground_truth(),
            path,
            frame: Some(frame),
        };
        stats.frames += 1;
        self.act(Action::Record(Box::new(record)));
        if let Some(error) = self.picture.as_mut().and_then(|picture| picture.error.take()) {
            self.lost_in_a_row += 1;
            self.note_lost(error.into());
        } else {
            self.lost_in_a_row = 0;
        }
    }

    /// Returns |e| of the position that the board has filtered, metres; `None` where it has no
    /// target, or no position of the ball.
    fn filtered_error(&mut self) -> Option<f64> {
        let telemetry = self.board.telemetry.as_ref()?;
        let named = self.sent.named_by(telemetry);
        self.knows_ball |= named.is_some_and(|position| position.has_ball);
        let error = telemetry.target.map(|_| telemetry.filtered_error.to_si());
        error.filter(|_| self.knows_ball)
    }
}
