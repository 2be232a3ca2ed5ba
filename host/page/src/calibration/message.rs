//! Messages between a calibration and its page. docs/use/page.md lists them.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::message::FrameView;

/// Command of a person who calibrates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CalibrationCommand {
    /// Chooses this pixel (column, row) for the next point. It is inside the picture.
    Click(Point2<f64>),
    /// Forgets the last point.
    Undo,
    /// Accepts the pose: it is to be written.
    Accept,
    /// Ends without a change.
    Quit,
}

/// Message of a page.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum FromPage {
    /// Acknowledges an update and its picture.
    Seen {
        update: u64,
    },
    Click {
        /// Column and row, pixels.
        u: f64,
        v: f64,
    },
    // Braces: of a variant without them, serde takes unknown keys.
    Undo {},
    Accept {},
    Quit {},
}

/// Message of the program.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(super) enum ToPage<'a> {
    /// First message.
    Hello {
        version: u32,
        subject: &'static str,
        /// Names of the points to choose, in their order.
        names: &'a [String],
        /// File that gets the pose.
        file: &'a str,
    },
    /// State. A binary message with a JPEG follows if `picture` is there.
    Update {
        number: u64,
        picture: Option<FrameView>,
        #[serde(flatten)]
        state: &'a CalibrationState,
        /// How the calibration ended, once it has.
        ended: Option<&'a str>,
    },
}

/// State of a calibration, as its page shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct CalibrationState {
    /// Points that are chosen, in the order of their names.
    pub marks: Vec<MarkView>,
    /// Pose from the points; `None` until there are enough of them, or if they give none.
    pub result: Option<ResultView>,
    /// Reason why the last command was refused, or why the points give no pose.
    pub problem: Option<String>,
}

/// Point that is chosen in the picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarkView {
    /// Name of the point.
    pub name: String,
    /// Column and row, pixels.
    pub pixel: [f64; 2],
    /// Depth, metres; `None` where none is needed.
    pub depth: Option<f64>,
}

/// Pose that the points give, in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ResultView {
    /// Lines for people: grade, pose, errors, notes.
    pub lines: Vec<String>,
    /// Whether the pose may be accepted.
    pub acceptable: bool,
}
