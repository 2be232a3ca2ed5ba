//! Kalman filter of the ball's position and velocity.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Point3, Vector3, Vector6};

use super::view::{Eye, View};
use crate::observation::Gaussian3;

/// Standard deviation of the velocity before anything is known of it, metres a second: rigs drive
/// up to 0.3 m/s.
const VELOCITY_SD: f64 = 0.3;

/// Standard deviation of a stamp, seconds: drivers of webcams are off by up to ±3 ms.
const STAMP_SD_S: f64 = 0.001_7;

/// State of the ball at a time.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    /// Time, seconds.
    pub(super) stamp: f64,
    /// Position, metres, and velocity, metres a second, rig frame.
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
}

impl Motion {
    /// Starts at a position with an unknown velocity.
    pub(super) fn new(stamp: f64, position: &Gaussian3) -> Self {
        let mut state = Vector6::zeros();
        state.fixed_rows_mut::<3>(0).copy_from(&position.mean.coords);
        let mut covariance = Matrix6::identity() * VELOCITY_SD.powi(2);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&position.covariance);
        Self { stamp, state, covariance }
    }

    /// Returns the state at `stamp`, with an acceleration of white noise of density `noise`,
    /// m/s²/√Hz. A `stamp` before the state's leaves it.
    pub(super) fn predicted(&self, stamp: f64, noise: f64) -> Self {
        let dt = stamp - self.stamp;
        if dt.is_nan() || dt <= 0.0 {
            return self.clone();
        }
        let mut step = Matrix6::identity();
        step.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * dt));
        let mut covariance = step * self.covariance * step.transpose();
        for axis in 0..3 {
            let density = noise * noise;
            covariance[(axis, axis)] += density * dt.powi(3) / 3.0;
            covariance[(axis, axis + 3)] += density * dt.powi(2) / 2.0;
            covariance[(axis + 3, axis)] += density * dt.powi(2) / 2.0;
            covariance[(axis + 3, axis + 3)] += density * dt;
        }
        Self { stamp, state: step * self.state, covariance }
    }

    /// Returns the velocity, metres a second.
    pub(super) fn velocity(&self) -> Vector3<f64> {
        self.state.fixed_rows::<3>(3).into()
    }

    /// Returns the position.
    pub(super) fn position(&self) -> Gaussian3 {
        let mean = Point3::from(Vector3::from(self.state.fixed_rows::<3>(0)));
        Gaussian3 { mean, covariance: self.covariance.fixed_view::<3, 3>(0, 0).into() }
    }

    /// Returns the covariance of a ray's place after it was moved along by `dt` seconds, metres²:
    /// that of the velocity, of accelerations of density `noise` and of the ray's stamp.
    pub(super) fn moved_covariance(&self, dt: f64, noise: f64) -> Matrix3<f64> {
        let velocity = self.velocity();
        let covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(3, 3).into();
        covariance * (dt * dt)
            + Matrix3::identity() * (noise * noise * dt.abs().powi(3) / 3.0)
            + (velocity * velocity.transpose() + covariance) * (STAMP_SD_S * STAMP_SD_S)
    }

    /// Returns the covariance of a movement of unknown velocity in `dt` seconds, metres².
    pub(super) fn unknown_movement(dt: f64) -> Matrix3<f64> {
        Matrix3::identity() * VELOCITY_SD.powi(2) * (dt * dt + STAMP_SD_S * STAMP_SD_S)
    }

    /// Returns the squared Mahalanobis distance between the state's position and `other`.
    pub(super) fn distance2(&self, other: &Gaussian3) -> f64 {
        let Gaussian3 { mean, covariance } = self.position();
        let off = other.mean - mean;
        let inverse = (covariance + other.covariance).try_inverse();
        inverse.map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
    }

    /// Returns the difference of a view from what the state predicts, its derivatives by the state
    /// and its covariance. A view may be older than the state.
    fn innovation(&self, eye: &Eye, view: &View) -> Option<Innovation> {
        let delay = self.stamp - view.stamp;
        let velocity = self.velocity();
        let place = self.position().mean - velocity * delay;
        let projection = eye.project(&place)?;
        let mut derivatives = Matrix3x6::zeros();
        derivatives.fixed_view_mut::<3, 3>(0, 0).copy_from(&projection.derivatives);
        derivatives.fixed_view_mut::<3, 3>(0, 3).copy_from(&(projection.derivatives * -delay));
        let smear = projection.derivatives * velocity * STAMP_SD_S;
        let noise = view.covariance + smear * smear.transpose();
        let covariance = derivatives * self.covariance * derivatives.transpose() + noise;
        Some(Innovation { off: view.seen - projection.seen, derivatives, noise, covariance })
    }

    /// Returns the squared Mahalanobis distance of column and row of a view from the prediction;
    /// `None` where the ball would not be in front of the camera.
    pub(super) fn view_distance2(&self, eye: &Eye, view: &View) -> Option<f64> {
        let Innovation { off, covariance, .. } = self.innovation(eye, view)?;
        let inverse = covariance.fixed_view::<2, 2>(0, 0).try_inverse()?;
        Some(off.xy().dot(&(inverse * off.xy())))
    }

    /// Takes a view in. A view that cannot be is left out.
    pub(super) fn update(&mut self, eye: &Eye, view: &View) {
        let Some(Innovation { off, derivatives, noise, covariance }) = self.innovation(eye, view)
        else {
            return;
        };
        let Some(inverse) = covariance.try_inverse() else { return };
        let gain = self.covariance * derivatives.transpose() * inverse;
        let state = self.state + gain * off;
        // Joseph's form stays positive.
        let rest = Matrix6::identity() - gain * derivatives;
        let covariance =
            rest * self.covariance * rest.transpose() + gain * noise * gain.transpose();
        if state.iter().chain(covariance.iter()).all(|it| it.is_finite()) {
            (self.state, self.covariance) = (state, covariance);
        }
    }
}

/// Difference of a view from its prediction.
struct Innovation {
    /// Column, row and radius, pixels.
    off: Vector3<f64>,
    /// Derivatives by the state.
    derivatives: Matrix3x6<f64>,
    /// Covariance of the view alone, pixels².
    noise: Matrix3<f64>,
    /// Covariance of `off`, pixels².
    covariance: Matrix3<f64>,
}
