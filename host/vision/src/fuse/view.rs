//! A camera of the pair, and one of its pictures as pixels of an ideal lens.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::camera::Camera;
use crate::localise::localise_by_outline;
use crate::observation::{Circle, Gaussian3};

/// Variance added to column, row and radius, pixels²: no detector is better than .03 pixels.
const MIN_VARIANCE_PX2: f64 = 0.001;

/// Largest column, row, radius and standard deviation, focal lengths: 84 degrees from the axis.
const MAX_FOCALS: f64 = 10.0;

/// One of the two cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The first camera of [`PairFuser::new`](super::PairFuser::new).
    First,
    /// The second one.
    Second,
}

impl Side {
    /// Both sides, in order.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    /// Returns the other side.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }

    /// Returns the index in arrays of two.
    pub(super) const fn index(self) -> usize {
        self as usize
    }
}

/// The ball in one picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Time of exposure, seconds.
    pub(super) stamp: f64,
    /// Circle of the detector.
    pub(super) circle: Circle,
    /// Column and row from the principal point of a lens without distortion, and radius, pixels.
    pub(super) seen: Vector3<f64>,
    /// Covariance of `seen`, pixels².
    pub(super) covariance: Matrix3<f64>,
}

impl View {
    /// Returns the largest standard deviation of column, row and radius, pixels.
    pub(super) fn deviation(&self) -> f64 {
        self.covariance.diagonal().max().sqrt()
    }

    /// Returns the view with a radius that is smaller by `error` pixels, whose variance is larger
    /// by `variance`, pixels².
    pub(super) fn corrected(mut self, error: f64, variance: f64) -> Self {
        // No error explains more than half of a radius.
        let radius = (self.circle.radius - error).max(self.circle.radius / 2.0);
        (self.circle.radius, self.seen.z) = (radius, radius);
        self.covariance[(2, 2)] += variance;
        self
    }
}

/// Where a point is seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projection {
    /// As [`View::seen`].
    pub(super) seen: Vector3<f64>,
    /// Derivatives of `seen` by the point in the rig frame, pixels per metre.
    pub(super) derivatives: Matrix3<f64>,
}

/// A camera as the fusion needs it.
#[derive(Debug, Clone)]
pub(super) struct Eye {
    camera: Camera,
    to_camera: Isometry3<f64>,
    /// Focal length, pixels.
    pub(super) focal: f64,
}

impl Eye {
    /// Creates the eye of `camera`.
    pub(super) fn new(camera: Camera) -> Self {
        let (to_camera, focal) = (camera.pose.inverse(), camera.intrinsics.focal());
        Self { camera, to_camera, focal }
    }

    /// Returns the place of the lens, rig frame, metres.
    pub(super) fn origin(&self) -> Vector3<f64> {
        self.camera.pose.translation.vector
    }

    /// Returns the unit vector towards the centre of the ball, rig frame.
    pub(super) fn direction(&self, view: &View) -> Vector3<f64> {
        let ray = Vector3::new(view.seen.x, view.seen.y, self.focal);
        self.camera.pose.rotation * ray.normalize()
    }

    /// Returns the view of a circle; `None` if its numbers are no circle's or the distortion of the
    /// lens folds there.
    pub(super) fn view(&self, stamp: f64, circle: &Circle) -> Option<View> {
        let &Circle { u, v, radius, covariance } = circle;
        let is_circle = [u, v, radius].iter().all(|it| it.is_finite()) && radius > 0.0;
        if !is_circle {
            return None;
        }
        let lens = &self.camera.intrinsics;
        let ray = lens.deproject(u, v, 1.0);
        let plane = lens.deproject_derivatives(u, v, self.focal)?;
        let mut stretch = Matrix3::identity();
        stretch.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
        let covariance = stretch * (covariance + covariance.transpose()) * stretch.transpose()
            / 2.0
            + Matrix3::identity() * MIN_VARIANCE_PX2;
        let seen = Vector3::new(self.focal * ray.x, self.focal * ray.y, radius);
        let largest = MAX_FOCALS * self.focal;
        let is_in_reach = seen.amax() < largest
            && covariance.iter().all(|it| it.is_finite() && it.abs() < largest * largest);
        covariance.cholesky().filter(|_| is_in_reach)?;
        Some(View { stamp, circle: *circle, seen, covariance })
    }

    /// Returns where a ball at `point` (rig frame, metres) is seen; `None` if it is not in front of
    /// the camera.
    pub(super) fn project(&self, point: &Point3<f64>) -> Option<Projection> {
        let Point3 { coords: at } = self.to_camera * point;
        let ball_radius = self.camera.ball_diameter / 2.0;
        let clearance = at.norm_squared() - ball_radius * ball_radius;
        if !(at.z > ball_radius && clearance > 0.0) {
            return None;
        }
        let scale = self.focal / at.z;
        // The cone of the outline, as in `localise_by_outline`.
        let radius = scale * ball_radius * at.norm() / clearance.sqrt();
        let seen = Vector3::new(scale * at.x, scale * at.y, radius);
        let mut derivatives = Matrix3::from_diagonal(&Vector3::new(scale, scale, 0.0));
        derivatives.set_column(2, &(-seen / at.z));
        let rotation = self.to_camera.rotation.to_rotation_matrix();
        Some(Projection { seen, derivatives: derivatives * rotation.matrix() })
    }

    /// Returns the position that the outline of a view gives.
    pub(super) fn cone(&self, view: &View) -> Option<Gaussian3> {
        localise_by_outline(&view.circle, &self.camera.intrinsics, &self.camera)
    }
}
