//! Rays from a disc's centre, along which its outline is looked for.
//!
//! A sphere is seen as a cone, so its image is a circle only on the optical axis and an ellipse
//! elsewhere. The rays are laid out in a plane across the direction to the ball: there the outline
//! is a circle wherever the ball is.

use std::array;
use std::f64::consts::TAU;
use std::sync::LazyLock;

use multiversion::multiversion;
use nalgebra::{Point3, Vector3};

use super::ray_colours::{RAYS, RayColours, read_between, read_nearest};
use super::view::{ColourView, Disc};
use crate::camera::Intrinsics;

/// Direction of a ray: cosine and sine of its angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction {
    pub(super) cos: f64,
    pub(super) sin: f64,
}

/// The directions of all rays.
static DIRECTIONS: LazyLock<[Direction; RAYS]> = LazyLock::new(|| {
    array::from_fn(|ray| {
        let (sin, cos) = (TAU * ray as f64 / RAYS as f64).sin_cos();
        Direction { cos, sin }
    })
});

/// Returns the directions of all rays.
#[inline]
pub(super) fn directions() -> &'static [Direction; RAYS] {
    &DIRECTIONS
}

/// The rays of a disc.
///
/// Points are homogeneous pixel coordinates, so that they add up along a ray. With a distortion,
/// which bends the rays in the image, they are in camera axes.
pub(super) struct RadialScan<'a> {
    image: &'a ColourView<'a>,
    intrinsics: &'a Intrinsics,
    directions: &'static [Direction; RAYS],
    /// The disc's centre.
    centre: Vector3<f64>,
    /// A pixel of the disc's radius to the right of it, and down.
    right: Vector3<f64>,
    down: Vector3<f64>,
}

impl<'a> RadialScan<'a> {
    /// Lays out the rays of `disc`.
    pub(super) fn new(image: &'a ColourView<'a>, disc: &Disc) -> Self {
        let intrinsics = image.intrinsics();
        let ahead = intrinsics.deproject(disc.u, disc.v, 1.0).coords.normalize();
        let right = (Vector3::x() - ahead * ahead.x).normalize();
        let down = ahead.cross(&right);
        let [right, down] = image
            .flattening
            .map_or([right, down], |m| [0, 1].map(|k| right * m[(0, k)] + down * m[(1, k)]));
        let homogeneous = |p: Vector3<f64>| {
            if intrinsics.distortion.is_some() {
                return p;
            }
            let u = intrinsics.fx * p.x + intrinsics.cx * p.z;
            Vector3::new(u, intrinsics.fy * p.y + intrinsics.cy * p.z, p.z)
        };
        let pixel = ahead.z / intrinsics.focal();
        let [centre, right, down] = [ahead, right * pixel, down * pixel].map(homogeneous);
        Self { image, intrinsics, directions: directions(), centre, right, down }
    }

    /// Returns column and row of a point; NaN beyond the fold of a distortion.
    #[inline]
    fn pixel(&self, point: &Vector3<f64>) -> (f64, f64) {
        if self.intrinsics.distortion.is_none() {
            let inverse = 1.0 / point.z;
            return (point.x * inverse, point.y * inverse);
        }
        self.intrinsics.project(&Point3::from(*point)).unwrap_or((f64::NAN, f64::NAN))
    }

    /// Returns a pixel of the disc's radius along a ray.
    #[inline]
    fn step(&self, ray: usize) -> Vector3<f64> {
        let Direction { cos, sin } = self.directions[ray];
        self.right * cos + self.down * sin
    }

    /// Returns column and row of the point `distance` pixels of the disc's radius from the centre;
    /// `None` behind the camera.
    #[inline]
    pub(super) fn at(&self, ray: usize, distance: f64) -> Option<(f64, f64)> {
        let point = self.centre + self.step(ray) * distance;
        (point.z > 1e-9).then(|| self.pixel(&point))
    }

    /// Returns the disc of `radius` moved by the first two components of `step` across the
    /// direction to it, and grown by the third, pixels. It grows or shrinks by 0.6 to 1.6 at most.
    pub(super) fn moved(&self, radius: f64, step: &Vector3<f64>) -> Disc {
        let moved = self.pixel(&(self.centre + self.right * step.x + self.down * step.y));
        // A step beyond the fold of a distortion is not taken.
        let (u, v) = if moved.0.is_nan() { self.pixel(&self.centre) } else { moved };
        Disc { u, v, radius: (radius + step.z).clamp(0.6 * radius, 1.6 * radius) }
    }

    /// Reads the colours of the nearest pixels on all rays from `start`, every `step` pixels of the
    /// disc's radius. Returns the number of samples on each ray until it leaves the image; beyond
    /// them nothing of use is read.
    pub(super) fn read_nearest<const N: usize>(
        &self,
        start: f64,
        step: f64,
        colours: &mut [RayColours; N],
    ) -> [usize; RAYS] {
        let (pixels, size) = (self.image.pixels(), self.image.size());
        let mut points = Points::new(self, &[start; RAYS], &[step; RAYS]);
        let (mut counts, mut inside) = ([0; RAYS], [true; RAYS]);
        for colours in colours {
            read_nearest(pixels, size, points.next_pixels(), &mut inside, colours);
            counts.iter_mut().zip(inside).for_each(|(count, inside)| *count += usize::from(inside));
        }
        counts
    }

    /// Reads the colours between pixels (bilinear) on all rays: of each from its start (pixels of
    /// the disc's radius from the centre), and every step from there. Returns which rays are in the
    /// image; of the others nothing of use is read.
    ///
    /// OpenCV's `remap` rounds places to 1/32 pixel (`INTER_BITS` is 5), too coarse for the edges.
    pub(super) fn read_bilinear<const N: usize>(
        &self,
        starts: &[f64; RAYS],
        steps: &[f64; RAYS],
        colours: &mut [RayColours; N],
    ) -> [bool; RAYS] {
        let (width, height) = self.image.size();
        if width < 2 || height < 2 {
            return [false; RAYS];
        }
        let bytes = self.image.pixels().as_flattened();
        let is_inside = |point: &Vector3<f64>| {
            let (u, v) = self.pixel(point);
            u >= 0.0 && v >= 0.0 && u < (width - 1) as f64 && v < (height - 1) as f64
        };
        let inside = array::from_fn(|ray| {
            let along = self.step(ray);
            let (start, step) = (self.centre + along * starts[ray], along * steps[ray]);
            // All points between two points in the image are in it, but for a fraction of a pixel
            // with a distortion.
            is_inside(&start) && is_inside(&(start + step * (N - 1) as f64))
        });
        let mut points = Points::new(self, starts, steps);
        for colours in colours {
            read_between(bytes, width, points.next_pixels(), colours);
        }
        inside
    }
}

/// A point on each ray, which moves outwards in steps.
struct Points<'a> {
    scan: &'a RadialScan<'a>,
    /// Homogeneous pixel coordinates, or camera axes (see [`RadialScan`]).
    points: [[f64; RAYS]; 3],
    moves: [[f64; RAYS]; 3],
    /// Columns and rows.
    pixels: [[f64; RAYS]; 2],
}

impl<'a> Points<'a> {
    /// Makes the points at these starts, pixels of the disc's radius from the centre, which move by
    /// these steps.
    fn new(scan: &'a RadialScan, starts: &[f64; RAYS], steps: &[f64; RAYS]) -> Self {
        let (mut points, mut moves) = ([[0.0; RAYS]; 3], [[0.0; RAYS]; 3]);
        for ray in 0..RAYS {
            let along = scan.step(ray);
            let (start, step) = (scan.centre + along * starts[ray], along * steps[ray]);
            for axis in 0..3 {
                (points[axis][ray], moves[axis][ray]) = (start[axis], step[axis]);
            }
        }
        Self { scan, points, moves, pixels: [[0.0; RAYS]; 2] }
    }

    /// Returns columns and rows of the points, NaN beyond the fold of a distortion, and moves the
    /// points.
    fn next_pixels(&mut self) -> &[[f64; RAYS]; 2] {
        if self.scan.intrinsics.distortion.is_none() {
            divide(&self.points, &mut self.pixels);
        } else {
            for ray in 0..RAYS {
                let point = Vector3::from(self.points.map(|axis| axis[ray]));
                (self.pixels[0][ray], self.pixels[1][ray]) = self.scan.pixel(&point);
            }
        }
        let points = self.points.as_flattened_mut().iter_mut();
        points.zip(self.moves.as_flattened()).for_each(|(point, step)| *point += step);
        &self.pixels
    }
}

/// Writes columns and rows of homogeneous points.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn divide([x, y, z]: &[[f64; RAYS]; 3], [columns, rows]: &mut [[f64; RAYS]; 2]) {
    for ray in 0..RAYS {
        let inverse = 1.0 / z[ray];
        (columns[ray], rows[ray]) = (x[ray] * inverse, y[ray] * inverse);
    }
}
