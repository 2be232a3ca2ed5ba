//! The box around a run, and its projection onto the drawing.

use nalgebra::{Point3, Vector3};

use crate::plot_axis::round_step;

/// Direction of the viewer: degrees from x towards y, and above the horizon.
const AZIMUTH_DEG: f64 = -25.0;
const ELEVATION_DEG: f64 = 22.0;

/// Box along the axes with bounds on round numbers, one step for all axes; metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    /// Corner with the least coordinates.
    pub(super) least: Point3<f64>,
    /// Corner with the greatest coordinates.
    pub(super) greatest: Point3<f64>,
    /// Distance between two ticks, metres.
    pub(super) step: f64,
}

impl Bounds {
    /// Returns the box around some points; `None` if there are none.
    pub(super) fn around<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Option<Self> {
        let (least, greatest) = points.fold(None, |bounds, p| {
            Some(bounds.map_or((*p, *p), |(a, b): (Point3<f64>, Point3<f64>)| (a.inf(p), b.sup(p))))
        })?;
        let step = round_step((greatest - least).max().max(0.1), 9.0);
        let least = least.map(|c| (c / step + 1e-9).floor() * step);
        let greatest = greatest.map(|c| (c / step - 1e-9).ceil() * step);
        // A box of no thickness has no walls.
        let greatest = greatest.sup(&(least + Vector3::repeat(step)));
        Some(Self { least, greatest, step })
    }

    /// Returns the box down to the floor, z = 0, if that is not farther below it than it is high.
    pub(super) fn down_to_floor(self) -> Self {
        let height = self.greatest.z - self.least.z;
        let is_near = (0.0..=height).contains(&self.least.z);
        let z = if is_near { 0.0 } else { self.least.z };
        Self { least: Point3::new(self.least.x, self.least.y, z), ..self }
    }

    /// Returns the ticks of axis `axis` (0, 1, 2 for x, y, z), metres.
    pub(super) fn ticks(&self, axis: usize) -> Vec<f64> {
        let count = ((self.greatest[axis] - self.least[axis]) / self.step).round() as i32;
        (0..=count).map(|k| self.least[axis] + f64::from(k) * self.step).collect()
    }

    /// Returns the corner with the greatest (true) or least coordinate along each axis.
    pub(super) fn corner(&self, greatest: [bool; 3]) -> Point3<f64> {
        Point3::from(std::array::from_fn(|i| {
            if greatest[i] { self.greatest[i] } else { self.least[i] }
        }))
    }
}

/// Projection from metres in space to pixels, with the same scale along all axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Projection {
    right: Vector3<f64>,
    up: Vector3<f64>,
    scale: f64,
    offset: (f64, f64),
}

impl Projection {
    /// Fits the box into the rectangle from `top_left` to `bottom_right`, pixels.
    pub(super) fn fit(bounds: &Bounds, top_left: (f64, f64), bottom_right: (f64, f64)) -> Self {
        let (azimuth, elevation) = (AZIMUTH_DEG.to_radians(), ELEVATION_DEG.to_radians());
        let right = Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let eye = Vector3::new(
            azimuth.cos() * elevation.cos(),
            azimuth.sin() * elevation.cos(),
            elevation.sin(),
        );
        let up = eye.cross(&right);
        let extent = |axis: &Vector3<f64>| {
            let at = |value: bool| -> f64 {
                let pick = |i: usize| {
                    if (axis[i] > 0.0) == value { bounds.greatest[i] } else { bounds.least[i] }
                };
                (0..3).map(|i| axis[i] * pick(i)).sum()
            };
            (at(false), at(true))
        };
        let ((left, far_right), (bottom, top)) = (extent(&right), extent(&up));
        let (width, height) = (bottom_right.0 - top_left.0, bottom_right.1 - top_left.1);
        let scale = (width / (far_right - left)).min(height / (top - bottom));
        let offset = (
            (top_left.0 + bottom_right.0 - scale * (left + far_right)) / 2.0,
            (top_left.1 + bottom_right.1 + scale * (bottom + top)) / 2.0,
        );
        Self { right, up, scale, offset }
    }

    /// Returns the position of a point on the drawing: pixels to the right and down.
    pub(super) fn pixel(&self, p: &Point3<f64>) -> (i32, i32) {
        let (x, y) = (self.right.dot(&p.coords), self.up.dot(&p.coords));
        (
            (self.offset.0 + self.scale * x).round() as i32,
            (self.offset.1 - self.scale * y).round() as i32,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_is_round_and_holds_the_points() {
        let points = [Point3::new(0.85, 0.61, 0.665), Point3::new(0.0, 0.0, 0.15)];
        let bounds = Bounds::around(points.iter()).unwrap();
        assert!((bounds.step - 0.1).abs() < 1e-12, "{bounds:?}");
        assert!((bounds.greatest - Point3::new(0.9, 0.7, 0.7)).norm() < 1e-12, "{bounds:?}");
        assert!((bounds.least - Point3::new(0.0, 0.0, 0.1)).norm() < 1e-12, "{bounds:?}");
        assert_eq!(bounds.ticks(2).len(), 7);
        assert_eq!(Bounds::around([].iter()), None);
        let dot = Bounds::around([Point3::new(0.2, 0.2, 0.2)].iter()).unwrap();
        assert!((dot.greatest - dot.least).min() > 0.0, "{dot:?}");
    }

    #[test]
    fn the_floor_is_at_zero_where_that_is_near() {
        let floor = |low: f64, high: f64| {
            let points = [Point3::new(0.0, 0.0, low), Point3::new(0.5, 0.5, high)];
            Bounds::around(points.iter()).unwrap().down_to_floor().least.z
        };
        assert_eq!((floor(0.15, 0.665), floor(-0.3, 0.2)), (0.0, floor(-0.3, 0.1)));
        assert!((floor(2.0, 2.5) - 2.0).abs() < 1e-9, "the floor is too far away");
    }

    #[test]
    fn the_projection_fits_and_has_z_upwards_and_y_to_the_right() {
        let bounds = Bounds::around([Point3::origin(), Point3::new(1.0, 0.8, 0.6)].iter()).unwrap();
        let view = Projection::fit(&bounds, (100.0, 50.0), (900.0, 700.0));
        for k in 0..8u8 {
            let (x, y) = view.pixel(&bounds.corner([k & 1 > 0, k & 2 > 0, k & 4 > 0]));
            assert!((100..=900).contains(&x) && (50..=700).contains(&y), "({x}, {y})");
        }
        let at = |x, y, z| view.pixel(&Point3::new(x, y, z));
        let origin = at(0.0, 0.0, 0.0);
        assert!(at(0.0, 0.0, 0.5).1 < origin.1 && at(0.0, 0.0, 0.5).0 == origin.0, "z is up");
        assert!(at(0.0, 0.5, 0.0).0 > origin.0, "y is to the right");
        assert!(at(0.5, 0.0, 0.0).1 > origin.1, "x comes towards the eye");
    }
}
