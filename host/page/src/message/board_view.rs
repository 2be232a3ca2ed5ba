//! State of the board as the page shows it.

use plumb_protocol::message::State;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::board_report::{driver_warnings, near_slack};
use plumb_runtime::observer::FrameRecord;
use serde::Serialize;

/// State of the board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct BoardView {
    /// Name of the state.
    pub(crate) state: &'static str,
    pub(crate) fault: Option<FaultView>,
    /// Motor rates A, B, C, full steps/s, + pays out.
    pub(crate) rates: [f64; 3],
    /// Motor positions, full steps from the zero of travel, + pays out.
    pub(crate) motors: [f64; 3],
    /// |e| of the filtered position, metres; `None` without a target, and before the board has
    /// accepted a position of the ball.
    pub(crate) filtered_error: Option<f64>,
    /// Speed of the path's time, 1 where the motors and the ball keep up; `None` without a path.
    pub(crate) pace: Option<f64>,
    /// Number of damaged frames that the board received.
    pub(crate) bad_frames: u16,
    /// The law's estimate of the cables' tensions; `None` without one.
    pub(crate) tensions: Option<TensionView>,
    /// Warnings of drivers on a UART in words; `None` of other drivers.
    pub(crate) drivers: Option<String>,
}

/// Estimated tensions of cables A, B, C.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct TensionView {
    /// Tensions over the ball's weight.
    pub(crate) weights: [f64; 3],
    /// Whether each cable is near slack.
    pub(crate) near_slack: [bool; 3],
}

/// Reason why the board stopped by itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct FaultView {
    pub(crate) text: String,
    /// What to do next.
    pub(crate) next: &'static str,
}

impl BoardView {
    /// Returns the board's state of a record; `None` before the first telemetry.
    pub(crate) fn of(record: &FrameRecord) -> Option<Self> {
        let board = record.board?;
        Some(Self {
            state: state_name(board.state),
            fault: record.board_fault().map(Into::into),
            rates: board.rates.map(|rate| (rate * 10.0).round() / 10.0 + 0.0),
            motors: board.motors,
            filtered_error: record.filtered_error,
            pace: record.path.map(|path| (path.pace * 100.0).round() / 100.0),
            bad_frames: board.bad_frames,
            tensions: board.tensions.map(Into::into),
            drivers: board.drivers.as_ref().map(driver_warnings),
        })
    }
}

impl From<BoardFault> for FaultView {
    fn from(fault: BoardFault) -> Self {
        Self { text: fault.to_string(), next: fault.advice() }
    }
}

impl From<[f64; 3]> for TensionView {
    fn from(tensions: [f64; 3]) -> Self {
        let weights = tensions.map(|tension| (tension * 1e3).round() / 1e3);
        Self { weights, near_slack: near_slack(tensions) }
    }
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
