//! Camera model: intrinsics, pose in the rig frame, and the ball that the camera looks for.

use nalgebra::{Isometry3, Matrix2, Point2, Point3};

use crate::distortion::checked_places;
use crate::image::ImageSize;

pub use crate::distortion::{
    CoefficientsError, Distortion, DistortionCoefficients, DistortionError, is_of_angles,
};

/// Intrinsics of a colour picture and of the depth registered to it: a pinhole camera with the
/// distortion of its lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the rows, pixels.
    pub fx: f64,
    /// Focal length along the columns, pixels.
    pub fy: f64,
    /// Principal point, pixels from the centre of the left-most pixel.
    pub cx: f64,
    /// Principal point, pixels from the centre of the top-most pixel.
    pub cy: f64,
    /// Units of the depth picture in a metre (5000 in TUM RGB-D, 1000 for millimetres); 0 for a
    /// camera without depth.
    pub depth_scale: f64,
    /// Distortion of the lens; `None` for a pinhole camera.
    pub distortion: Option<Distortion>,
}

impl Intrinsics {
    /// Returns whether the camera measures depth.
    #[inline]
    pub fn has_depth(&self) -> bool {
        self.depth_scale > 0.0
    }

    /// Returns the point at pixel (`u`, `v`) and depth `z` metres along the optical axis, in camera
    /// axes (x right, y down, z forward), metres.
    ///
    /// Where the distortion has no inverse (see [`Self::check_distortion`]), the point is that of
    /// the ray that is seen nearest to the pixel.
    #[inline]
    pub fn deproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        match &self.distortion {
            None => Point3::new((u - self.cx) / self.fx * z, (v - self.cy) / self.fy * z, z),
            Some(distortion) => {
                let ray = distortion.nearest_ray(&self.image(u, v));
                Point3::new(ray.x * z, ray.y * z, z)
            }
        }
    }

    /// Returns the derivatives of the point at pixel (`u`, `v`) and depth `z` (metres): rows x and
    /// y, columns `u` and `v`, metres per pixel. `None` where the distortion folds.
    #[inline]
    pub fn deproject_derivatives(&self, u: f64, v: f64, z: f64) -> Option<Matrix2<f64>> {
        let pinhole = Matrix2::new(z / self.fx, 0.0, 0.0, z / self.fy);
        let Some(distortion) = &self.distortion else { return Some(pinhole) };
        let ray = distortion.nearest_ray(&self.image(u, v));
        Some(distortion.derivatives(&ray).try_inverse()? * pinhole)
    }

    /// Returns the pixel of a point in camera axes (metres); `None` for a point that is not in
    /// front of the camera, or farther from the axis than the distortion reaches.
    #[inline]
    pub fn project(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        let is_in_front = p.z > 1e-9;
        if !is_in_front {
            return None;
        }
        match &self.distortion {
            None => Some((self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy)),
            Some(distortion) => {
                let image = distortion.distort(&Point2::new(p.x / p.z, p.y / p.z))?;
                Some((self.fx * image.x + self.cx, self.fy * image.y + self.cy))
            }
        }
    }

    /// Returns the largest factor by which the distortion stretches the picture about the image of
    /// a point in camera axes; 1 without distortion.
    pub fn stretch(&self, p: &Point3<f64>) -> f64 {
        self.distortion.as_ref().map_or(1.0, |distortion| {
            let derivatives = distortion.derivatives(&Point2::new(p.x / p.z, p.y / p.z));
            derivatives.singular_values().max()
        })
    }

    /// Returns a pixel in focal lengths from the principal point.
    #[inline]
    fn image(&self, u: f64, v: f64) -> Point2<f64> {
        Point2::new((u - self.cx) / self.fx, (v - self.cy) / self.fy)
    }

    /// Checks that every pixel of a picture of `width` x `height` pixels has a ray.
    ///
    /// # Errors
    /// Returns the place nearest to the principal point where the distortion has no inverse.
    pub fn check_distortion(&self, width: usize, height: usize) -> Result<(), DistortionError> {
        let Some(distortion) = &self.distortion else { return Ok(()) };
        let has_ray = |&(u, v): &(f64, f64)| distortion.undistort(&self.image(u, v)).is_some();
        let distance = |&(u, v): &(f64, f64)| (u - self.cx).hypot(v - self.cy);
        let without = checked_places(width, height).filter(|place| !has_ray(place));
        match without.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            Some((u, v)) => Err(DistortionError { u, v, width, height }),
            None => Ok(()),
        }
    }

    /// Returns the mean of the two focal lengths, pixels.
    #[inline]
    pub fn focal(&self) -> f64 {
        (self.fx + self.fy) / 2.0
    }

    /// Returns the radius (pixels, on the optical axis) of a ball of radius `ball_radius` at depth
    /// `z`, both metres.
    #[inline]
    pub fn radius_at(&self, ball_radius: f64, z: f64) -> f64 {
        self.focal() * ball_radius / z
    }

    /// Returns the depth, metres, of a ball of radius `ball_radius` (metres) that is seen with
    /// `radius` pixels.
    #[inline]
    pub fn depth_of(&self, ball_radius: f64, radius: f64) -> f64 {
        self.focal() * ball_radius / radius
    }
}

/// Pictures that intrinsics belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CalibratedFor {
    /// Those of this size.
    Size(ImageSize),
    /// Those of a size that is not stated.
    Unstated,
    /// None yet: the intrinsics are a guess, and are to be estimated.
    Nothing,
}

/// Model of a camera and of the ball that it looks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Projection.
    pub intrinsics: Intrinsics,
    /// Pictures that the intrinsics belong to.
    pub calibrated_for: CalibratedFor,
    /// From camera axes into the rig frame.
    pub pose: Isometry3<f64>,
    /// Diameter of the ball, metres.
    pub ball_diameter: f64,
    /// Hue of the ball, degrees: 0 red, 60 yellow, 120 green, 180 cyan, 240 blue, 300 magenta.
    pub ball_hue: f64,
    /// Whether the ball moves in the plane x = 0 of the rig frame: without depth, its place is
    /// where its ray meets that plane.
    pub is_planar: bool,
}

impl Camera {
    /// Makes a camera that looks for a red ball of this diameter, metres. The size of the pictures
    /// that the intrinsics belong to is not stated.
    pub fn new(intrinsics: Intrinsics, pose: Isometry3<f64>, ball_diameter: f64) -> Self {
        let calibrated_for = CalibratedFor::Unstated;
        Self { intrinsics, calibrated_for, pose, ball_diameter, ball_hue: 0.0, is_planar: false }
    }

    /// Returns the depth along the optical axis, metres, of a point in the rig frame.
    #[inline]
    pub fn depth_of(&self, point: &Point3<f64>) -> f64 {
        self.pose.inverse_transform_point(point).z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns intrinsics with 60 degrees of view over 640 columns.
    fn intrinsics(k1: f64) -> Intrinsics {
        let coefficients = DistortionCoefficients { k1, k2: 0.1, p1: 0.001, p2: 0.0, k3: 0.0 };
        let distortion = Distortion::new(coefficients);
        let (fx, fy, cx, cy) = (554.0, 556.0, 322.0, 237.0);
        Intrinsics { fx, fy, cx, cy, depth_scale: 1000.0, distortion }
    }

    #[test]
    fn projecting_is_the_inverse_of_deprojecting() {
        let lens = intrinsics(-0.3);
        for (u, v) in checked_places(640, 480) {
            let p = lens.deproject(u, v, 1.7);
            let (column, row) = lens.project(&p).unwrap();
            assert!((column - u).hypot(row - v) < 1e-6, "({u}, {v}) became ({column}, {row})");
            assert_eq!(p.z, 1.7);
        }
        assert_eq!(lens.project(&Point3::new(0.0, 0.0, -1.0)), None);
        assert_eq!(intrinsics(-0.5).project(&Point3::new(1.1, 0.0, 1.0)), None);
    }

    #[test]
    fn the_derivatives_of_a_point_are_its_differences() {
        let (lens, u, v, z, h) = (intrinsics(-0.3), 500.0, 60.0, 1.2, 1e-4);
        let found = lens.deproject_derivatives(u, v, z).unwrap();
        for (k, (du, dv)) in [(h, 0.0), (0.0, h)].into_iter().enumerate() {
            let step = lens.deproject(u + du, v + dv, z) - lens.deproject(u - du, v - dv, z);
            assert!((found.column(k) - step.xy() / (2.0 * h)).norm() < 1e-9, "{found}");
        }
        let pinhole = Intrinsics { distortion: None, ..lens };
        let expected = Matrix2::new(z / pinhole.fx, 0.0, 0.0, z / pinhole.fy);
        assert_eq!(pinhole.deproject_derivatives(u, v, z), Some(expected));
    }

    #[test]
    fn a_distortion_without_an_inverse_is_refused_with_its_place() {
        assert_eq!(intrinsics(-0.3).check_distortion(640, 480), Ok(()));
        assert_eq!(intrinsics(0.0).check_distortion(640, 480), Ok(()));
        let error = intrinsics(-0.5).check_distortion(640, 480).unwrap_err();
        // The model folds at r = 1, which is seen 0.6 focal lengths from the principal point.
        let away = (error.u - 322.0).hypot(error.v - 237.0);
        assert!((325.0..350.0).contains(&away), "{error:?}");
        let text = error.to_string();
        assert!(text.contains("640x480") && text.contains("column"), "{text}");
    }
}
