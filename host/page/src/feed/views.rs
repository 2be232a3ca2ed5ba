//! Records of the run as the page shows them.

use std::time::{SystemTime, UNIX_EPOCH};

use plumb_runtime::observer::FrameRecord;
use plumb_runtime::operator::Stop;
use plumb_runtime::record::observation;

use crate::message::{FrameView, Sample, StopView};
use crate::sight::{SeenBall, Sight};

/// Rounds to the micrometre, or the microsecond.
pub(super) fn round(value: f64) -> f64 {
    // Zero is added to write -0 as 0.
    (value * 1e6).round() / 1e6 + 0.0
}

/// Returns the sample of a frame.
pub(super) fn sample(record: &FrameRecord) -> Sample {
    let position = record.position().map(|p| <[f64; 3]>::from(p).map(round));
    let position = position.map_or([None; 3], |p| p.map(Some));
    let target = record.target.map(|p| <[f64; 3]>::from(p).map(round));
    let target = target.map_or([None; 3], |p| p.map(Some));
    Sample(record.number, round(record.time), position, record.error().map(round), target)
}

/// Returns a frame with the ball and the target in it.
pub(super) fn frame_view(record: &FrameRecord, sight: Option<&Sight>) -> FrameView {
    let lens = record.frame.as_ref().map(|frame| frame.intrinsics());
    let target = sight.zip(lens).zip(record.target);
    FrameView {
        number: record.number,
        ball: record.observation.zip(record.position()).map(|(ball, position)| SeenBall {
            circle: [ball.circle.u, ball.circle.v, ball.circle.radius],
            position: position.into(),
        }),
        record: observation(record),
        target_px: target.and_then(|((sight, lens), target)| sight.pixel(lens, &target)),
    }
}

/// Returns the Stop in force.
pub(super) fn stop_view(stop: Stop) -> StopView {
    StopView {
        number: stop.number,
        by: stop.by.to_string(),
        since_ms: milliseconds(stop.since),
        refused: stop.refused,
    }
}

/// Returns a time of the wall clock, milliseconds since 1970.
pub(super) fn milliseconds(time: SystemTime) -> u64 {
    // A clock before 1970 is wrong anyway.
    let time = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}
