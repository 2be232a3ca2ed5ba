//! Shapes for trying.

use std::f64::consts::TAU;
use std::str::FromStr;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::curve::{Curve, Section};
use crate::motion::{MotionLimits, PathError, Run, Waypoints, check_near};
use crate::spline::{Ends, interpolate};
use crate::trajectory::Trajectory;

pub use crate::motion::{LEAST_SIZE_M, MAX_SIZE_M};

/// Number of places through which a circle or a figure of eight is interpolated. The curve is then
/// within a millionth of its size.
const PLACES: usize = 96;

/// Number of places of a random spline.
const SPLINE_PLACES: usize = 8;

/// Range of a random place's distance from the centre, as shares of half the size.
const SPLINE_RADII: [f64; 2] = [0.4, 1.0];

/// Largest distance of a random place from the plane, as a share of half the size.
const SPLINE_HEIGHT: f64 = 0.5;

/// Shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShapeKind {
    /// Circle; the size is its diameter.
    Circle,
    /// Straight line along the plane's first axis; a loop goes to and fro. The size is its length.
    Line,
    /// Figure of eight, (cos a, sin a cos a); the size is its width, twice its height.
    Eight,
    /// Square with rounded corners; the size is its side.
    Square,
    /// Random closed spline, in three dimensions; the size is its largest width in the plane.
    Spline,
}

/// Plane of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Plane {
    /// Level: the axes x and y.
    #[default]
    Level,
    /// Upright: the axes y and z.
    Upright,
}

/// Shape of a given size in a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Kind.
    pub kind: ShapeKind,
    /// Centre, metres.
    pub centre: Point3<f64>,
    /// Size, metres, from [`LEAST_SIZE_M`] to [`MAX_SIZE_M`].
    pub size: f64,
    /// Plane.
    pub plane: Plane,
    /// Largest distance of a rounded corner from the corner of a square, metres.
    pub tolerance: f64,
    /// Seed of the random spline.
    pub seed: u64,
}

/// Word that names no shape.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("'{0}' is no shape; shapes are circle, line, eight, square and spline")]
pub struct UnknownShape(pub String);

impl ShapeKind {
    /// All kinds.
    const ALL: [Self; 5] = [Self::Circle, Self::Line, Self::Eight, Self::Square, Self::Spline];

    /// Returns the name of the shape.
    pub fn name(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Line => "line",
            Self::Eight => "eight",
            Self::Square => "square",
            Self::Spline => "spline",
        }
    }
}

impl FromStr for ShapeKind {
    type Err = UnknownShape;

    fn from_str(word: &str) -> Result<Self, UnknownShape> {
        let is_named = |kind: &Self| kind.name().eq_ignore_ascii_case(word);
        Self::ALL.into_iter().find(is_named).ok_or_else(|| UnknownShape(word.to_owned()))
    }
}

impl Shape {
    /// Returns the trajectory along the shape.
    ///
    /// # Errors
    /// Where the size, the centre or a limit is out of its range.
    pub fn trajectory(&self, limits: &MotionLimits, run: Run) -> Result<Trajectory, PathError> {
        if !(LEAST_SIZE_M..=MAX_SIZE_M).contains(&self.size) {
            return Err(PathError::Size(self.size));
        }
        check_near([&self.centre])?;
        match self.kind {
            ShapeKind::Line => {
                let ends = [[-0.5, 0.0], [0.5, 0.0]];
                Trajectory::through(&self.waypoints(&ends), limits, run)
            }
            ShapeKind::Square => {
                let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]];
                Trajectory::through(&self.waypoints(&corners), limits, run)
            }
            ShapeKind::Circle => {
                let place = |angle: f64| self.place([angle.cos() / 2.0, angle.sin() / 2.0], 0.0);
                self.smooth(&round(place), limits, run)
            }
            ShapeKind::Eight => {
                let place = |angle: f64| {
                    let (sin, cos) = angle.sin_cos();
                    self.place([cos / 2.0, sin * cos / 2.0], 0.0)
                };
                self.smooth(&round(place), limits, run)
            }
            ShapeKind::Spline => self.smooth(&self.random_places(), limits, run),
        }
    }

    fn waypoints(&self, places: &[[f64; 2]]) -> Waypoints {
        let places = places.iter().map(|place| Point3::from(self.place(*place, 0.0))).collect();
        Waypoints { places, speeds: Vec::new(), tolerance: self.tolerance }
    }

    /// Returns the trajectory along the periodic spline through these places.
    fn smooth(
        &self,
        places: &[Vector3<f64>],
        limits: &MotionLimits,
        run: Run,
    ) -> Result<Trajectory, PathError> {
        // Chord lengths as steps keep the speed over the parameter nearly constant.
        let steps: Vec<f64> = places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let pieces = interpolate(places, &steps, Ends::Periodic);
        let section = |polynomial| Section { polynomial, stops: false, speed: f64::INFINITY };
        let sections = pieces.into_iter().map(section).collect();
        Trajectory::along(Curve::new(sections, run == Run::Loop), limits)
    }

    /// Returns a place from its coordinates in the plane and its distance from it, as shares of the
    /// size.
    fn place(&self, [first, second]: [f64; 2], height: f64) -> Vector3<f64> {
        let offset = match self.plane {
            Plane::Level => Vector3::new(first, second, height),
            Plane::Upright => Vector3::new(height, first, second),
        };
        self.centre.coords + offset * self.size
    }

    /// Returns random places around the centre, the first one again at the end.
    fn random_places(&self) -> Vec<Vector3<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let [low, high] = SPLINE_RADII;
        let mut places: Vec<_> = (0..SPLINE_PLACES)
            .map(|i| {
                let turn = (i as f64 + random.random_range(0.0..0.5)) / SPLINE_PLACES as f64;
                let radius = random.random_range(low..high) / 2.0;
                let height = random.random_range(-SPLINE_HEIGHT..SPLINE_HEIGHT) / 2.0;
                let (sin, cos) = (TAU * turn).sin_cos();
                self.place([radius * cos, radius * sin], height)
            })
            .collect();
        places.push(places[0]);
        places
    }
}

/// Returns places at equal angles round a closed curve, the first one again at the end.
fn round(place: impl Fn(f64) -> Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut places: Vec<_> = (0..PLACES).map(|i| place(TAU * i as f64 / PLACES as f64)).collect();
    places.push(places[0]);
    places
}
