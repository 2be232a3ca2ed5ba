//! Camera model: intrinsics, pose in the rig frame, and the ball that the camera looks for.

use nalgebra::{Isometry3, Point3};

/// Pinhole intrinsics of a colour picture and of the depth registered to it, without distortion.
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
}

impl Intrinsics {
    /// Returns whether the camera measures depth.
    #[inline]
    pub fn has_depth(&self) -> bool {
        self.depth_scale > 0.0
    }

    /// Returns the point at pixel (`u`, `v`) and depth `z` metres along the optical axis, in camera
    /// axes (x right, y down, z forward), metres.
    #[inline]
    pub fn deproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        Point3::new((u - self.cx) / self.fx * z, (v - self.cy) / self.fy * z, z)
    }

    /// Returns the pixel of a point in camera axes (metres); `None` for a point that is not in
    /// front of the camera.
    #[inline]
    pub fn project(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        (p.z > 1e-9).then(|| (self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy))
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

/// Model of a camera and of the ball that it looks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Projection.
    pub intrinsics: Intrinsics,
    /// From camera axes into the rig frame.
    pub pose: Isometry3<f64>,
    /// Diameter of the ball, metres.
    pub ball_diameter: f64,
    /// Hue of the ball, degrees: 0 red, 60 yellow, 120 green, 180 cyan, 240 blue, 300 magenta.
    pub ball_hue: f64,
}

impl Camera {
    /// Returns the depth along the optical axis, metres, of a point in the rig frame.
    #[inline]
    pub fn depth_of(&self, point: &Point3<f64>) -> f64 {
        self.pose.inverse_transform_point(point).z
    }
}
