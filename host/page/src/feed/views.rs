//! Records of the run as the page shows them.

use std::time::{SystemTime, UNIX_EPOCH};

use plumb_protocol::message::State;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::operator::Stop;
use plumb_runtime::tension::near_slack;

use crate::message::{BoardView, FaultView, FrameView, Sample, StopView, TensionView};

/// Rounds to the micrometre, or the microsecond.
fn round(value: f64) -> f64 {
    // Zero is added to write -0 as 0.
    (value * 1e6).round() / 1e6 + 0.0
}

/// Returns the sample of a frame.
pub(super) fn sample(record: &FrameRecord) -> Sample {
    let position = record.position().map(|p| <[f64; 3]>::from(p).map(round));
    let position = position.map_or([None; 3], |p| p.map(Some));
    let target = <[f64; 3]>::from(record.target).map(round);
    Sample(record.number, round(record.time), position, record.error().map(round), target)
}

/// Returns a frame with the ball in it.
pub(super) fn frame_view(record: &FrameRecord) -> FrameView {
    FrameView {
        number: record.number,
        time: round(record.time),
        circle: record.observation.map(|ball| {
            let circle = ball.circle;
            [circle.u, circle.v, circle.radius].map(|pixels| (pixels * 100.0).round() / 100.0)
        }),
        position: record.position().map(|p| <[f64; 3]>::from(p).map(round)),
    }
}

/// Returns the board's state; `None` before the first telemetry.
pub(super) fn board_view(record: &FrameRecord) -> Option<BoardView> {
    let board = record.board?;
    let view = |fault: BoardFault| FaultView { text: fault.to_string(), next: fault.advice() };
    Some(BoardView {
        state: state_name(board.state),
        fault: record.board_fault().map(view),
        rates: board.rates.map(|rate| (rate * 10.0).round() / 10.0 + 0.0),
        motors: board.motors,
        filtered_error: record.filtered_error,
        pace: record.path.map(|path| (path.pace * 100.0).round() / 100.0),
        bad_frames: board.bad_frames,
        tensions: board.tensions.map(tension_view),
    })
}

/// Returns the Stop that holds.
pub(super) fn stop_view(stop: Stop) -> StopView {
    StopView {
        number: stop.number,
        by: stop.by.to_string(),
        since: milliseconds(stop.since),
        refused: stop.refused,
    }
}

/// Returns a time of the wall clock, milliseconds since 1970.
pub(super) fn milliseconds(time: SystemTime) -> u64 {
    // A clock before 1970 is wrong anyway.
    let time = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// Returns the estimated tensions with their marks.
fn tension_view(tensions: [f64; 3]) -> TensionView {
    let weights = tensions.map(|tension| (tension * 1e3).round() / 1e3);
    TensionView { weights, near_slack: near_slack(tensions) }
}

/// Returns the name of a state, without its details.
fn state_name(state: State) -> &'static str {
    match state {
        State::Unconfigured => "unconfigured",
        State::Ready => "ready",
        State::Seeking => "seeking",
        State::Holding => "holding",
        State::Fault(_) => "fault",
        State::Jogging => "jogging",
        State::Stopping => "stopping",
        State::Storing => "storing",
        State::Following => "following",
    }
}
