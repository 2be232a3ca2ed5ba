//! Two jogs at a board, with the pictures of a camera.

use nalgebra::Vector2;
use plumb_frame::camera::Intrinsics;
use plumb_frame::image::ImageSize;
use plumb_frame::observation::BallObservation;
use plumb_protocol::message::Jog;
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::link::{Link, Transport};
use plumb_runtime::rig::flat;

use super::latency::Moving;
use super::{RATE, TwoMotors};
use crate::watch::{Watch, WatchError, WatchParts};

/// Time from the end of a jog to the first picture that counts, seconds.
const SETTLE_S: f64 = 0.4;

/// Board and camera of a rig of two motors. Places are pixels without the distortion of the lens,
/// from the principal point.
pub struct BoardHand<'a, 'p, T> {
    watch: Watch<'a, 'p, T>,
    lens: Intrinsics,
}

impl<'a, 'p, T: Transport> BoardHand<'a, 'p, T> {
    /// Takes the configured board at `link` and the camera of `parts`, whose lens is `lens`.
    ///
    /// # Errors
    /// [`WatchError::NotLive`].
    pub fn new(
        link: &'a mut Link<T>,
        parts: &'a mut WatchParts<'p>,
        lens: Intrinsics,
    ) -> Result<Self, WatchError> {
        Ok(Self { watch: Watch::new(link, parts)?, lens })
    }

    /// Returns the size of the last picture; `None` before the first one.
    pub fn picture_size(&self) -> Option<ImageSize> {
        self.watch.size
    }

    /// Returns the turn of a motor, full steps from the zero of travel.
    fn turned(&mut self, motor: usize) -> Result<f64, WatchError> {
        let telemetry = self.watch.link.status()?;
        Ok(telemetry.motors.get(motor).map_or(0.0, |at| at.to_si()))
    }
}

/// Returns where the ball is seen.
fn place(lens: &Intrinsics, ball: &BallObservation) -> Vector2<f64> {
    flat(lens, [ball.circle.u, ball.circle.v])
}

impl<T: Transport> TwoMotors for BoardHand<'_, '_, T> {
    type Error = WatchError;

    fn look(&mut self, pictures: usize) -> Result<Vec<Vector2<f64>>, WatchError> {
        let (mut taken, mut seen, lens) = (0, Vec::new(), self.lens);
        while taken < pictures {
            self.watch.tend(|(_, ball)| {
                taken += 1;
                seen.extend(ball.map(|ball| place(&lens, &ball)));
            })?;
        }
        Ok(seen)
    }

    fn jog(&mut self, motor: usize, steps: f64) -> Result<Moving, WatchError> {
        (self.watch.parts.progress)(&format!("motor {}: {steps:+.0} steps", super::MOTORS[motor]));
        let (begin, mut moving, lens) = (self.turned(motor)?, Moving::default(), self.lens);
        let distance = Steps16::from_si(steps).unwrap_or_default();
        let rate = Rate::from_si(RATE).unwrap_or_default();
        self.watch.link.jog(Jog { motor: motor as u8, distance, rate })?;
        let mut end = f64::INFINITY;
        while self.watch.parts.source.now() < end {
            let telemetry = self.watch.tend(|(time, ball)| {
                moving.pictures.extend(ball.map(|ball| (time, place(&lens, &ball))));
            })?;
            let now = self.watch.parts.source.now();
            let at = telemetry.motors.get(motor).map_or(begin, |at| at.to_si());
            moving.turned.push((now, at - begin));
            if end.is_infinite() && !self.watch.link.is_jogging(&telemetry)? {
                end = now + SETTLE_S;
            }
        }
        Ok(moving)
    }
}
