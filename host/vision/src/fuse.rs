//! Fusion of two ordinary cameras into one depth camera.
//!
//! Two cameras look at one ball, each at its own moments. [`PairFuser`] takes the circle of each
//! picture and returns one position for each pair of pictures, with its covariance, at the newer
//! exposure:
//!
//! ```text
//! circle, covariance, stamp (First)  -+-> velocity (Kalman filter of the rays)
//! circle, covariance, stamp (Second) -+-> older ray moved by v Δt -> point, covariance
//!                                     +-> calibration: radii, latencies, alarms
//! ```
//!
//! Where only one camera sees the ball, its outline gives the position, with a radius that is
//! corrected by what the pairs have shown.
//!
//! ```
//! use nalgebra::{Isometry3, Matrix3, Point3, Translation3};
//! use plumb_vision::camera::{Camera, Intrinsics};
//! use plumb_vision::fuse::{Origin, PairFuser, Side};
//! use plumb_vision::observation::Circle;
//!
//! let (fx, fy, cx, cy) = (533.0, 533.0, 319.5, 239.5);
//! let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 0.0, distortion: None };
//! let pose = |x| Isometry3::from(Translation3::new(x, 0.0, 0.0));
//! let cameras = [-0.3, 0.3].map(|x| Camera::new(intrinsics, pose(x), 0.08));
//! let covariance = Matrix3::identity() * 0.04;
//! // A ball 1.2 m away, in the middle between them.
//! let circle = |u| Circle { u, v: 239.5, radius: 17.8, covariance };
//! let shift = 533.0 * 0.3 / 1.2;
//!
//! let mut fuser = PairFuser::new(cameras, 1.0 / 30.0);
//! assert_eq!(fuser.take(Side::First, 10.0, Some(circle(319.5 + shift)), 10.03), None);
//! let fused = fuser.take(Side::Second, 10.01, Some(circle(319.5 - shift)), 10.04);
//! let fused = fused.expect("both have seen it");
//! assert_eq!(fused.stamp, 10.01);
//! assert!((fused.position.mean - Point3::new(0.0, 0.0, 1.2)).norm() < 1e-3);
//! assert!(matches!(fused.origin, Origin::Pair(residual) if residual.abs() < 0.01));
//! ```

mod channel;
mod line;
mod monitor;
mod motion;
mod online_calibration;
mod triangulate;
mod view;

#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};

use crate::camera::Camera;
use crate::observation::{Circle, Gaussian3};
use channel::{Channel, Content};
use motion::Motion;
use online_calibration::{OnlineCalibration, PairSample};
use triangulate::{Gap, Ray, gap, triangulate};
use view::{Eye, View};

pub use monitor::{Alarm, Sign};
pub use view::Side;

/// Density of the acceleration's white noise, m/s²/√Hz.
const ACCELERATION_NOISE: f64 = 0.1;
/// Age above which a state predicts nothing any more, seconds.
const MAX_STATE_AGE_S: f64 = 0.5;
/// Squared Mahalanobis distance above which a measurement starts the filter again: of 3 dimensions
/// one in 50 000 correct ones.
const MAX_DISTANCE2: f64 = 25.0;
/// Least gap between two rays that do not see the same ball, pixels.
const MAX_GAP_PX: f64 = 3.0;
/// Deviations of the gap above which two rays do not see the same ball.
const MAX_GAP_DEVIATIONS: f64 = 6.0;
/// Time between a jump of one camera's rays and an alarm that it explains, seconds.
const MAX_JUMP_AGE_S: f64 = 1.0;
/// Standard deviation of a position where either camera may be the knocked one, metres: 1 degree at
/// 1.4 m.
const KNOCKED_SD_M: f64 = 0.025;

/// Variance of a radius of which nothing was learned, pixels².
const UNKNOWN_RADIUS_PX2: f64 = 0.5;
/// Largest step back of the positions' stamps that is no clock that was set back, seconds.
const MAX_SETBACK_S: f64 = 2.0;

/// A position of the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fused {
    /// Time of exposure, seconds on the clock of the stamps: of a pair that of the newer picture.
    pub stamp: f64,
    /// Centre of the ball, rig frame.
    pub position: Gaussian3,
    /// Pictures that it comes from.
    pub origin: Origin,
}

/// Pictures that a position comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// Both cameras'; with the residual: the signed distance between their rays, pixels.
    Pair(f64),
    /// The outline in one camera's.
    Outline(Side),
}

/// Fuses the circles of two cameras into positions.
///
/// Time is passed in: `now` and all stamps are seconds on one clock. After an alarm the fuser sends
/// outlines of one camera only; a new fuser starts again.
#[derive(Debug, Clone)]
pub struct PairFuser {
    eyes: [Eye; 2],
    /// Time between two pictures of a camera, seconds.
    period: f64,
    channels: [Channel; 2],
    motion: Option<Motion>,
    calibration: OnlineCalibration,
    alarm: Option<Alarm>,
    /// Jump of one camera's rays that the other's did not share, and its time.
    jump: Option<(Side, f64)>,
    /// Stamp of the last position.
    sent: Option<f64>,
}

impl PairFuser {
    /// Creates the fuser of two cameras with their poses, the first and the second. `period` is the
    /// time between two pictures of a camera, seconds; numbers outside 1 ms to 1 s are clamped.
    pub fn new(cameras: [Camera; 2], period: f64) -> Self {
        Self {
            eyes: cameras.map(Eye::new),
            // What is not a number becomes the shortest period.
            period: if period >= 0.001 { period.min(1.0) } else { 0.001 },
            channels: [Channel::default(), Channel::default()],
            motion: None,
            calibration: OnlineCalibration::new(),
            alarm: None,
            jump: None,
            sent: None,
        }
    }

    /// Takes a picture of one camera: its time of exposure, what the detector found (`None` if
    /// there is no ball), and the present time, both in seconds. Returns a position if this picture
    /// completes one.
    ///
    /// A picture is left out if its stamp is not after that of the one before, is more than a
    /// period after `now` or more than 1 s before it. A circle that cannot be (not finite, no
    /// radius, no covariance) counts as no ball.
    pub fn take(
        &mut self,
        side: Side,
        stamp: f64,
        circle: Option<Circle>,
        now: f64,
    ) -> Option<Fused> {
        let view = circle.and_then(|circle| self.eyes[side.index()].view(stamp, &circle));
        self.channels[side.index()].take(stamp, view, now, self.period);
        // The other camera is awaited from the first picture on.
        self.channels[side.other().index()].expect_from(now);
        self.poll(now)
    }

    /// Returns the position that the passing of time completes: the outline in one camera's picture
    /// where the other's last one is older than 1.5 periods. `now` is the present time, seconds.
    pub fn poll(&mut self, now: f64) -> Option<Fused> {
        if let Some(alarm) = self.alarm {
            let side = alarm.side.map_or(Side::First, Side::other);
            self.channels[side.other().index()].clear();
            let view = self.channels[side.index()].clear()?;
            return self.outline(side, &view);
        }
        let [first, second] = [0, 1].map(|side| self.channels[side].content(now, self.period));
        match (first, second) {
            (Content::Waiting, _) | (_, Content::Waiting) | (Content::Gone, Content::Gone) => None,
            (Content::Fresh, Content::Fresh) => self.both(),
            (Content::Fresh, Content::Gone) => self.one(Side::First),
            (Content::Gone, Content::Fresh) => self.one(Side::Second),
        }
    }

    /// Notes that a camera was unplugged: the other's outline is used until the next picture of
    /// this one.
    pub fn lose(&mut self, side: Side) {
        self.channels[side.index()].lose();
    }

    /// Notes that another check found a camera knocked, and raises the alarm, or names the camera
    /// of the present one.
    pub fn accuse(&mut self, side: Side) {
        let sign = self.alarm.map_or(Sign::Told, |alarm| alarm.sign);
        let alarm = Alarm { side: Some(side), sign };
        // A check that repeats itself changes nothing.
        if self.alarm != Some(alarm) {
            self.raise(alarm);
        }
    }

    /// Returns the alarm, if there was one.
    pub fn alarm(&self) -> Option<Alarm> {
        self.alarm
    }

    /// Returns by how much a camera's outline is too large, pixels, as the pairs have shown; `None`
    /// until it is known to ±0.1 pixels.
    pub fn radius_error(&self, side: Side) -> Option<f64> {
        self.calibration.radius_error(side)
    }

    /// Returns by how much the second camera's stamps are later than the first one's at the same
    /// exposure, seconds; `None` until it is known to ±1 ms. From then on it is compensated, half
    /// on each side.
    pub fn latency_difference(&self) -> Option<f64> {
        self.calibration.latency_difference()
    }

    /// Raises an alarm: nothing that was seen before counts any more.
    fn raise(&mut self, alarm: Alarm) {
        (self.alarm, self.motion) = (Some(alarm), None);
    }

    /// Returns the position of the fresh pictures of both cameras.
    fn both(&mut self) -> Option<Fused> {
        let views = [0, 1].map(|side| self.channels[side].clear());
        match views {
            [Some(first), Some(second)] => {
                let apart = (first.stamp - second.stamp).abs();
                if apart > 1.5 * self.period {
                    let newer = if first.stamp > second.stamp { 0 } else { 1 };
                    return self.outline(Side::BOTH[newer], &[first, second][newer]);
                }
                self.pair([first, second])
            }
            [Some(view), None] => self.outline(Side::First, &view),
            [None, Some(view)] => self.outline(Side::Second, &view),
            [None, None] => None,
        }
    }

    /// Returns the position of the fresh picture of one camera.
    fn one(&mut self, side: Side) -> Option<Fused> {
        let view = self.channels[side.index()].clear()?;
        self.outline(side, &view)
    }

    /// Returns a view with the learned radius and latency, and the variance of its radius by what
    /// was learned.
    fn corrected(&self, side: Side, view: &View) -> (View, f64) {
        let (error, variance) = self.calibration.radius(side, view.circle.radius);
        let mut corrected = view.corrected(error, 0.0);
        corrected.stamp = view.stamp + self.calibration.stamp_shift(side);
        (corrected, variance)
    }

    /// Returns the state at `stamp`; `None` if it is too old.
    fn predicted(&self, stamp: f64) -> Option<Motion> {
        let motion = self.motion.as_ref()?;
        let age = stamp - motion.stamp;
        (age.abs() < MAX_STATE_AGE_S).then(|| motion.predicted(stamp, ACCELERATION_NOISE))
    }

    /// Returns the position of a pair, and learns from it.
    fn pair(&mut self, raw: [View; 2]) -> Option<Fused> {
        let views = Side::BOTH.map(|side| {
            let (view, variance) = self.corrected(side, &raw[side.index()]);
            view.corrected(0.0, variance)
        });
        let stamp = views[0].stamp.max(views[1].stamp);
        let motion = self.predicted(stamp);
        let eyes = self.eyes.clone();
        let rays = [0, 1].map(|side| {
            let dt = stamp - views[side].stamp;
            let (shift, shift_covariance) = moved(motion.as_ref(), dt);
            Ray { eye: &eyes[side], view: &views[side], shift, shift_covariance }
        });
        let newer = Side::BOTH[usize::from(views[1].stamp > views[0].stamp)];
        let Some(found) = gap(&rays) else { return self.outline(newer, &raw[newer.index()]) };
        self.note_jump(motion.as_ref(), &views, stamp);
        let position = triangulate(&rays, found.middle);
        self.learn(stamp, &raw, &found, position.as_ref(), motion.as_ref());
        if self.alarm.is_some() {
            return None;
        }
        let largest = MAX_GAP_PX.max(MAX_GAP_DEVIATIONS * found.variance.sqrt());
        if found.pixels.abs() > largest {
            let side = nearer(motion.as_ref()?, &eyes, &views)?;
            return self.outline(side, &raw[side.index()]);
        }
        let position = position?;
        self.motion = Some(match motion {
            Some(mut motion) if motion.distance2(&position) <= MAX_DISTANCE2 => {
                eyes.iter().zip(&views).for_each(|(eye, view)| motion.update(eye, view));
                motion
            }
            _ => Motion::new(stamp, &position),
        });
        self.send(Fused { stamp, position, origin: Origin::Pair(found.pixels) })
    }

    /// Notes a jump of one camera's rays that the other's do not share. The first one of a second
    /// counts: the filter follows it.
    fn note_jump(&mut self, motion: Option<&Motion>, views: &[View; 2], stamp: f64) {
        let Some(motion) = motion else { return };
        if self.jump.is_some_and(|(_, at)| (0.0..=MAX_JUMP_AGE_S).contains(&(stamp - at))) {
            return;
        }
        let jumps = [0, 1].map(|side| {
            let distance2 = motion.view_distance2(&self.eyes[side], &views[side]);
            distance2.is_some_and(|distance2| distance2 > MAX_DISTANCE2)
        });
        match jumps {
            [true, false] => self.jump = Some((Side::First, stamp)),
            [false, true] => self.jump = Some((Side::Second, stamp)),
            _ => {}
        }
    }

    /// Learns from a pair of views as they were taken, and raises an alarm.
    fn learn(
        &mut self,
        stamp: f64,
        raw: &[View; 2],
        found: &Gap,
        position: Option<&Gaussian3>,
        motion: Option<&Motion>,
    ) {
        let velocity = motion.map_or_else(Vector3::zeros, Motion::velocity);
        let radii = [0, 1].map(|side| {
            let projection = self.eyes[side].project(&position?.mean)?;
            Some((raw[side].seen.z, projection.seen.z))
        });
        let sensitivity = found.by_movement.dot(&velocity);
        let sample = PairSample {
            stamp,
            gap: found.pixels,
            gap_variance: found.variance,
            sensitivity,
            radii,
        };
        let Some(sign) = self.calibration.learn(&sample, raw) else { return };
        let side = self.jump.filter(|(_, at)| stamp - at <= MAX_JUMP_AGE_S).map(|(side, _)| side);
        self.raise(Alarm { side, sign });
    }

    /// Returns the position of one camera's outline, filtered with what was known before.
    fn outline(&mut self, side: Side, raw: &View) -> Option<Fused> {
        let (view, radius_variance) = self.corrected(side, raw);
        let eye = &self.eyes[side.index()];
        let mut cone = eye.cone(&view)?;
        let along = (cone.mean.coords - eye.origin()) / view.circle.radius;
        cone.covariance += along * along.transpose() * radius_variance;
        let motion = match self.predicted(view.stamp) {
            Some(mut motion) if motion.distance2(&cone) <= MAX_DISTANCE2 => {
                motion.update(eye, &view);
                motion
            }
            _ => Motion::new(view.stamp, &cone),
        };
        let mut position = motion.position();
        // The error of what was learned is one for all pictures: the filter does not average it.
        position.covariance += along * along.transpose() * radius_variance;
        if self.alarm.is_some_and(|alarm| alarm.side.is_none()) {
            position.covariance += Matrix3::identity() * (KNOCKED_SD_M * KNOCKED_SD_M);
        }
        self.motion = Some(motion);
        self.send(Fused { stamp: view.stamp, position, origin: Origin::Outline(side) })
    }

    /// Returns a position if it is newer than the last one, or the clock was set back.
    fn send(&mut self, fused: Fused) -> Option<Fused> {
        let is_old = |sent: f64| fused.stamp <= sent && sent - fused.stamp < MAX_SETBACK_S;
        if self.sent.is_some_and(is_old) {
            return None;
        }
        self.sent = Some(fused.stamp);
        Some(fused)
    }
}

/// Returns the position of a ball at rest that two cameras see as `circles`; `None` if their rays
/// do not meet in front of both. It hardly depends on the radii.
pub fn intersect(cameras: &[Camera; 2], circles: &[Circle; 2]) -> Option<Gaussian3> {
    let eyes = cameras.each_ref().map(|camera| Eye::new(camera.clone()));
    let view = |side: usize| eyes[side].view(0.0, &circles[side]);
    let views = [view(0)?, view(1)?].map(|view| view.corrected(0.0, UNKNOWN_RADIUS_PX2));
    let (shift, shift_covariance) = (Vector3::zeros(), Matrix3::zeros());
    let rays =
        [0, 1].map(|side| Ray { eye: &eyes[side], view: &views[side], shift, shift_covariance });
    triangulate(&rays, gap(&rays)?.middle)
}

/// Returns the movement of a ball in `dt` seconds and its covariance.
fn moved(motion: Option<&Motion>, dt: f64) -> (Vector3<f64>, Matrix3<f64>) {
    match motion {
        Some(motion) => (motion.velocity() * dt, motion.moved_covariance(dt, ACCELERATION_NOISE)),
        None => (Vector3::zeros(), Motion::unknown_movement(dt)),
    }
}

/// Returns the camera whose view is nearer to the prediction.
fn nearer(motion: &Motion, eyes: &[Eye; 2], views: &[View; 2]) -> Option<Side> {
    let [first, second] = [0, 1].map(|side| motion.view_distance2(&eyes[side], &views[side]));
    Some(if first? <= second? { Side::First } else { Side::Second })
}
