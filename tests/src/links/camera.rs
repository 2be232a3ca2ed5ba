//! A cheap camera: small depth images with the ball at a fixed pixel, and a detector that returns
//! this pixel. Localisation, control loop and link are the real ones.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Point3};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use plumb_sim::simulated::{SimClock, SimulationError, Timing};
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::Image;
use plumb_vision::localise::observe;
use plumb_vision::observation::{BallObservation, Circle};
use plumb_vision::render::sphere_depth;

/// Rows and columns of an image, pixels.
const SIZE: usize = 15;
/// Row and column of the ball's centre in every image, pixels.
const CENTRE: f64 = 7.0;
/// Radius of the ball in every image, pixels.
const RADIUS: f64 = 6.0;
/// Units of depth per metre.
const DEPTH_SCALE: f64 = 10_000.0;
/// Variance of the centre's row and column, pixels²; the standard deviation is 0.1 pixel, as for
/// the detector `ball`.
const VARIANCE: f64 = 0.01;

/// A camera whose intrinsics follow the ball, so that the ball has the same pixel and radius in
/// every image.
pub struct TrackingCamera<C> {
    rig: C,
    camera: Camera,
    timing: Timing,
    next_capture: f64,
    /// Frames in transit: capture time, s, and position of the ball, m.
    in_transit: VecDeque<(f64, Point3<f64>)>,
}

impl<C: SimClock> TrackingCamera<C> {
    /// Returns a camera at the pose of `camera` that follows the ball of `rig`.
    pub fn new(rig: C, camera: Camera, timing: Timing) -> Self {
        let next_capture = rig.now();
        Self { rig, camera, timing, next_capture, in_transit: VecDeque::new() }
    }
}

/// Renders the frame of a ball at `ball`, m, captured at `time`, s, by a camera at the pose of
/// `camera`.
///
/// # Errors
/// If the ball is behind the camera.
pub fn tracking_frame(
    camera: &Camera,
    time: f64,
    ball: Point3<f64>,
) -> Result<RgbdFrame, SourceError> {
    let centre = camera.pose.inverse_transform_point(&ball).coords;
    let radius = camera.ball_diameter / 2.0;
    let focal = RADIUS * centre.z / radius;
    let principal = |offset: f64| CENTRE - focal * offset / centre.z;
    let intrinsics = Intrinsics {
        fx: focal,
        fy: focal,
        cx: principal(centre.x),
        cy: principal(centre.y),
        depth_scale: DEPTH_SCALE,
        distortion: None,
    };
    let depth = Image::from_fn(SIZE, SIZE, |column, row| {
        let ray = intrinsics.deproject(column as f64, row as f64, 1.0).coords;
        sphere_depth(&ray, &centre, radius).map_or(0, |z| (z * DEPTH_SCALE).round() as u16)
    });
    let colour = Image::filled(SIZE, SIZE, [0; 3]);
    let frame = RgbdFrame::new(time, colour, depth, intrinsics);
    Ok(frame.map_err(InvalidFrame::of(format!("the picture at {time} s")))?)
}

impl<C: SimClock> CameraSource for TrackingCamera<C> {
    /// Captures frames at the camera's rate and delivers them after the latency, as
    /// `SimulatedCamera` does.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Timing { rate, latency } = self.timing;
        loop {
            if let Some(&(taken, ball)) = self.in_transit.front()
                && taken + latency <= self.next_capture
            {
                self.in_transit.pop_front();
                self.rig.wait_until(taken + latency).map_err(SimulationError::Rig)?;
                return tracking_frame(&self.camera, taken, ball).map(Some);
            }
            self.rig.wait_until(self.next_capture).map_err(SimulationError::Rig)?;
            let now = self.rig.now();
            self.in_transit.push_back((now, self.rig.ball()));
            let missed = ((now - self.next_capture) * rate).floor().max(0.0);
            self.next_capture += (missed + 1.0) / rate;
        }
    }

    fn now(&self) -> f64 {
        self.rig.now()
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// A detector that returns the fixed pixel of a [`TrackingCamera`].
pub struct FixedDetector(pub Camera);

impl BallDetector for FixedDetector {
    fn name(&self) -> &'static str {
        "spot"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let covariance = Matrix3::identity() * VARIANCE;
        let circle = Circle { u: CENTRE, v: CENTRE, radius: RADIUS, covariance };
        Ok(Some(observe(circle, 1.0, frame, &self.0)))
    }
}

#[cfg(test)]
mod tests {
    use plumb_cameras::camera_file;

    use super::*;

    #[test]
    fn localisation_recovers_the_position() {
        let camera = camera_file::paper().expect("the paper's camera");
        for ball in [[0.54, 0.22, 0.459], [0.4, 0.4, 0.15], [0.7, 0.1, 0.3]].map(Point3::from) {
            let frame = tracking_frame(&camera, 0.0, ball).expect("a picture");
            let seen = FixedDetector(camera.clone()).detect(&frame);
            let seen = seen.expect("no error").expect("a ball");
            let position = seen.position.expect("a position").mean;
            // A unit of depth is 0.1 mm.
            assert!((position - ball).norm() < 1e-4, "{position} for {ball}");
        }
    }
}
