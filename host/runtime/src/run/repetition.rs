//! Detection of a camera that repeats one picture.

use std::sync::Arc;

use plumb_frame::frame::RgbdFrame;
use plumb_protocol::MotorList;
use plumb_protocol::message::Fault;
use plumb_protocol::units::Steps16;
use thiserror::Error;

/// Share of `following.turn` after which the ball must be seen in another place. A ball that
/// follows has moved by pixels then: with the paper's rig 25 steps pay out 12 mm of cable.
const VISIBLE_SHARE: i32 = 16;

/// A camera that repeats one picture with new time stamps, while motors turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "the camera repeats one picture: its pictures are the same to the last bit, but the motors \
     turn. Connect the camera anew{}",
    if fault.is_some() { ", then clear the fault" } else { "" }
)]
pub struct RepeatedPicture {
    /// Fault of the board at that time. Along a path the run may end before the board's deadline
    /// for a position: then there is none.
    pub fault: Option<Fault>,
}

/// Detector of a camera that repeats one picture.
///
/// Two pictures of a camera differ by their noise. A simulated camera without noise delivers the
/// same picture while the ball rests, and so may a camera in the dark. A picture is therefore
/// repeated only if it was taken after a motor had turned visibly, and is still the same.
#[derive(Debug)]
pub(super) struct RepetitionDetector {
    /// Turn of a motor that moves the ball visibly, Q4 steps.
    visible_turn: i32,
    /// First of the pictures in a row that are the same.
    first: Option<Arc<RgbdFrame>>,
    /// Motor positions when it arrived, Q4 steps; `None` before the first telemetry.
    motors: Option<MotorList<i32>>,
    /// When a motor had turned visibly since then, seconds on the source's clock.
    turned_at: Option<f64>,
    /// Whether the last picture was repeated.
    is_repeating: bool,
}

impl RepetitionDetector {
    /// Returns the detector for a rig whose `following.turn` is `turn`.
    pub(super) fn new(turn: Steps16) -> Self {
        Self {
            visible_turn: (turn.0 / VISIBLE_SHARE).max(1),
            first: None,
            motors: None,
            turned_at: None,
            is_repeating: false,
        }
    }

    /// Takes in a picture that arrived at `now`, seconds on the source's clock, and the newest
    /// motor positions. Returns whether the camera repeats an older picture.
    pub(super) fn update(
        &mut self,
        frame: &Arc<RgbdFrame>,
        motors: Option<MotorList<Steps16>>,
        now: f64,
    ) -> bool {
        let motors = motors.map(|motors| motors.map(|at| at.0));
        if !self.first.as_ref().is_some_and(|first| is_same(first, frame)) {
            self.first = Some(Arc::clone(frame));
            (self.motors, self.turned_at, self.is_repeating) = (motors, None, false);
            return false;
        }
        self.is_repeating = self.turned_at.is_some_and(|turned_at| frame.time() > turned_at);
        self.motors = self.motors.or(motors);
        if self.turned_at.is_none() && self.has_turned(motors) {
            self.turned_at = Some(now);
        }
        self.is_repeating
    }

    /// Returns whether the last picture was repeated.
    pub(super) fn is_repeating(&self) -> bool {
        self.is_repeating
    }

    /// Returns whether a motor has turned visibly since the first of the same pictures.
    fn has_turned(&self, motors: Option<MotorList<i32>>) -> bool {
        let (Some(before), Some(motors)) = (self.motors, motors) else { return false };
        before
            .iter()
            .zip(&motors)
            .any(|(before, at)| before.abs_diff(*at) >= self.visible_turn as u32)
    }
}

/// Returns whether two frames have the same images and intrinsics, to the last bit.
fn is_same(one: &RgbdFrame, other: &RgbdFrame) -> bool {
    one.intrinsics() == other.intrinsics()
        && one.depth() == other.depth()
        && one.colour() == other.colour()
}

#[cfg(test)]
mod tests {
    use plumb_frame::camera::Intrinsics;
    use plumb_frame::image::Image;

    use super::*;

    /// Time between two pictures, s.
    const PERIOD: f64 = 0.033;
    /// Age of a picture at its arrival, s.
    const AGE: f64 = 0.25;
    /// `following.turn`, Q4 steps.
    const TURN: i32 = 6_400;

    /// Returns a frame whose pixels have the value `value`.
    fn frame(time: f64, value: u8) -> Arc<RgbdFrame> {
        let intrinsics =
            Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1e3, distortion: None };
        let (colour, depth) = (Image::filled(2, 2, [value; 3]), Image::filled(2, 2, 500));
        Arc::new(RgbdFrame::new(time, colour, depth, intrinsics).unwrap())
    }

    /// Returns the numbers of the pictures that count as repeated: of 60, with the values `value`
    /// and motor B at `motor`, Q4 steps, of the picture's number.
    fn repeated(value: impl Fn(usize) -> u8, motor: impl Fn(usize) -> i32) -> Vec<usize> {
        let mut detector = RepetitionDetector::new(Steps16(TURN));
        (0..60)
            .filter(|&k| {
                let time = k as f64 * PERIOD;
                let motors = [0, motor(k), 0].map(Steps16);
                detector.update(&frame(time, value(k)), Some(motors.into()), time + AGE)
            })
            .collect()
    }

    #[test]
    fn one_picture_is_repeated_once_it_was_taken_after_a_motor_had_turned() {
        // From picture 10 on a motor turns by 6 steps a picture: 25 steps after 5 pictures.
        let motor = |k: usize| 100 * k.saturating_sub(10) as i32;
        let first = 10 + 4 + (AGE / PERIOD).ceil() as usize;
        assert_eq!(repeated(|_| 7, motor), (first..60).collect::<Vec<_>>());
        assert_eq!(repeated(|_| 7, |k| -motor(k)), (first..60).collect::<Vec<_>>());
    }

    #[test]
    fn the_same_picture_of_a_rig_at_rest_is_fresh() {
        let jitter = |k: usize| if k.is_multiple_of(2) { TURN / VISIBLE_SHARE - 1 } else { 0 };
        assert!(repeated(|_| 7, |_| 0).is_empty());
        assert!(repeated(|_| 7, jitter).is_empty());
    }

    #[test]
    fn a_picture_that_changes_is_fresh() {
        assert!(repeated(|k| (k % 2) as u8, |k| 1_000 * k as i32).is_empty());
        // A short stand-still of the camera ends with its next picture.
        let short = |k: usize| if (20..30).contains(&k) { 7 } else { (k % 2) as u8 };
        let found = repeated(short, |k| 1_000 * k as i32);
        assert!(!found.is_empty() && found.iter().all(|k| (22..30).contains(k)), "{found:?}");
    }

    #[test]
    fn without_telemetry_no_picture_counts_as_repeated() {
        let mut detector = RepetitionDetector::new(Steps16(TURN));
        let mut update = |k: i32, motors| {
            let time = f64::from(k) * PERIOD;
            detector.update(&frame(time, 7), motors, time)
        };
        assert!((0..20).all(|k| !update(k, None)));
        // The first telemetry is the place that a turn counts from.
        assert!((20..40).all(|k| !update(k, Some([Steps16(9_000); 3].into()))));
    }
}
