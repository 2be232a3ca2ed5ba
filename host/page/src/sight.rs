//! Points of the rig in the camera's picture: where they are seen, and which one a click means.

use nalgebra::{Isometry3, Point3, Vector3};
use plumb_frame::camera::{Camera, Intrinsics};
use plumb_frame::frame::RgbdFrame;
use serde::{Serialize, Serializer};

/// Half the side of the square whose depths are read about a click, pixels.
const DEPTH_REACH: i32 = 2;

/// Least number of known depths in that square.
const LEAST_DEPTHS: usize = 5;

/// Distance above which a pixel and the image of its own ray differ: it has no ray. Pixels.
const LENS_ERROR: f64 = 1.0;

/// Number of parts between the lines of the plane, and between the points of a line.
const PARTS: usize = 4;
const POINTS: usize = 8;

/// Camera as the page needs it: its place in the rig, and the radius of the ball that hangs there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// From camera axes into the rig frame.
    pose: Isometry3<f64>,
    /// Metres.
    ball_radius: f64,
}

/// Box with edges along the rig's axes: smallest and largest coordinates, metres.
pub(crate) type Corners = [[f64; 3]; 2];

/// A click into the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Click {
    /// Column and row; the middle of the first pixel is 0, 0.
    pub(crate) pixel: [f64; 2],
    /// Point that the plane goes through, metres in the rig frame.
    pub(crate) through: [f64; 3],
    /// Whether the depth of the picture counts.
    pub(crate) with_depth: bool,
}

/// Ball that was found in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeenBall {
    /// Column, row and radius of its disc, pixels.
    pub(crate) circle: [f64; 3],
    /// Measured position, metres in the rig frame.
    pub(crate) position: [f64; 3],
}

/// Source of the point of a click.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Source {
    /// The ball: the click is on its disc.
    Ball,
    /// The surface at the pixel: the ball would touch it.
    Depth,
    /// The plane through the chosen point.
    Plane,
}

/// Plane through a point of the rig: the one of x, y or z that faces the camera most.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct PlaneView {
    /// Name of the coordinate that is the same on the whole plane.
    pub(crate) axis: &'static str,
    /// Lines on the plane, from edge to edge of the workspace. Column and row of each point,
    /// pixels; `null` where it is not in front of the camera.
    pub(crate) lines: Vec<Vec<Option<[f64; 2]>>>,
}

/// Line of sight in the rig frame.
struct Ray {
    /// Place of the camera.
    origin: Point3<f64>,
    /// Vector to the point at a depth of 1 m.
    direction: Vector3<f64>,
}

impl Ray {
    /// Returns the point at `depth` metres along the optical axis.
    fn at(&self, depth: f64) -> Point3<f64> {
        self.origin + self.direction * depth
    }
}

/// Writes the name of the plane's coordinate: all that a browser needs.
impl Serialize for Sight {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(NAMES[self.axis()])
    }
}

const NAMES: [&str; 3] = ["x", "y", "z"];

impl Sight {
    /// Returns the sight of a camera.
    pub fn of(camera: &Camera) -> Self {
        Self { pose: camera.pose, ball_radius: camera.ball_diameter / 2.0 }
    }

    /// Returns column and row of a point of the rig; `None` if it is not in front of the camera.
    pub(crate) fn pixel(&self, lens: &Intrinsics, point: &Point3<f64>) -> Option<[f64; 2]> {
        let (u, v) = lens.project(&self.pose.inverse_transform_point(point))?;
        (u.is_finite() && v.is_finite())
            .then(|| [u, v].map(|pixels| (pixels * 10.0).round() / 10.0))
    }

    /// Returns the number of the axis that is nearest to the camera's: a plane across it is seen
    /// from its front, and a click into it is exact.
    fn axis(&self) -> usize {
        (self.pose.rotation * Vector3::z()).iamax()
    }

    /// Returns the plane through a point, as the camera sees its part in the workspace.
    pub(crate) fn plane(
        &self,
        lens: &Intrinsics,
        workspace: &Corners,
        through: &Point3<f64>,
    ) -> PlaneView {
        let axis = self.axis();
        let sides = [(axis + 1) % 3, (axis + 2) % 3];
        let along = |side: usize, part: usize, parts: usize| {
            let [low, high] = workspace;
            low[side] + (high[side] - low[side]) * part as f64 / parts as f64
        };
        let line = |fixed: usize, free: usize, part: usize| {
            let points = (0..=POINTS).map(|k| {
                let mut point = *through;
                point[fixed] = along(fixed, part, PARTS);
                point[free] = along(free, k, POINTS);
                self.pixel(lens, &point)
            });
            points.collect()
        };
        let both = [(sides[0], sides[1]), (sides[1], sides[0])];
        let lines = both
            .into_iter()
            .flat_map(|(fixed, free)| (0..=PARTS).map(move |part| (fixed, free, part)));
        let lines = lines.map(|(fixed, free, part)| line(fixed, free, part)).collect();
        PlaneView { axis: NAMES[axis], lines }
    }

    /// Returns the point of the workspace that a click means, and its source. `ball` is the ball in
    /// the frame; `None` if it was not found.
    ///
    /// # Errors
    /// A message for the person, where the click means no point of the workspace.
    pub(crate) fn point(
        &self,
        frame: &RgbdFrame,
        ball: Option<&SeenBall>,
        workspace: &Corners,
        click: &Click,
    ) -> Result<(Point3<f64>, Source), String> {
        let ray = self.ray(frame, click.pixel)?;
        let inside = |point: &Point3<f64>| {
            let [low, high] = workspace;
            (0..3).all(|k| point[k] >= low[k] && point[k] <= high[k])
        };
        if let Some(&SeenBall { circle: [u, v, radius], position }) = ball
            && (click.pixel[0] - u).hypot(click.pixel[1] - v) <= radius
            && inside(&position.into())
        {
            return Ok((position.into(), Source::Ball));
        }
        if click.with_depth
            && let Some(point) = self.on_surface(frame, click.pixel, &ray)
            && inside(&point)
        {
            return Ok((point, Source::Depth));
        }
        let (axis, value) = (self.axis(), click.through[self.axis()]);
        let depth = (value - ray.origin[axis]) / ray.direction[axis];
        if !(depth.is_finite() && depth > 0.0) {
            return Err("this click does not meet the plane".to_owned());
        }
        let mut point = ray.at(depth);
        point[axis] = value;
        if inside(&point) {
            return Ok((point, Source::Plane));
        }
        let [x, y, z] = <[f64; 3]>::from(point);
        Err(format!("the place of this click is outside the workspace: ({x:.3}, {y:.3}, {z:.3}) m"))
    }

    /// Returns the ray of a pixel.
    fn ray(&self, frame: &RgbdFrame, [u, v]: [f64; 2]) -> Result<Ray, String> {
        let size = frame.colour().size();
        let is_within = |place: f64, count: usize| place >= -0.5 && place < count as f64 - 0.5;
        if !is_within(u, size.width) || !is_within(v, size.height) {
            return Err(format!("this click is outside the picture of {size} pixels"));
        }
        let lens = frame.intrinsics();
        let seen = lens.deproject(u, v, 1.0);
        let error = lens.project(&seen).map(|(column, row)| (column - u).hypot(row - v));
        if !error.is_some_and(|error| error <= LENS_ERROR) {
            return Err("the lens shows nothing known at this pixel".to_owned());
        }
        let origin = Point3::from(self.pose.translation.vector);
        Ok(Ray { origin, direction: self.pose.rotation * seen.coords })
    }

    /// Returns where the ball touches the surface at a pixel, from the camera's side; `None` where
    /// the depth is unknown.
    fn on_surface(&self, frame: &RgbdFrame, [u, v]: [f64; 2], ray: &Ray) -> Option<Point3<f64>> {
        let (column, row) = (u.round() as i32, v.round() as i32);
        let reach = -DEPTH_REACH..=DEPTH_REACH;
        let places = reach.clone().flat_map(|right| reach.clone().map(move |down| (right, down)));
        let depths = places.filter_map(|(right, down)| frame.depth_at(column + right, row + down));
        let mut depths: Vec<f64> = depths.collect();
        if depths.len() < LEAST_DEPTHS {
            return None;
        }
        depths.sort_by(f64::total_cmp);
        let surface = ray.at(depths[depths.len() / 2]);
        Some(surface - ray.direction.normalize() * self.ball_radius)
    }
}

#[cfg(test)]
mod tests;
