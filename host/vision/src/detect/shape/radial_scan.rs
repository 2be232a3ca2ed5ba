//! Rays from a disc's centre, along which its outline is looked for.
//!
//! A sphere is seen as a cone, so its image is a circle only on the optical axis and an ellipse
//! elsewhere. The rays are laid out in a plane across the direction to the ball: there the outline
//! is a circle wherever the ball is.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use multiversion::multiversion;
use nalgebra::{Point3, Vector3};

use super::view::{ColourView, Disc};
use crate::camera::Intrinsics;

/// Number of rays.
pub const RAYS: usize = 40;

/// Direction of a ray: cosine and sine of its angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction {
    pub(super) cos: f64,
    pub(super) sin: f64,
}

/// The directions of all rays.
static DIRECTIONS: LazyLock<[Direction; RAYS]> = LazyLock::new(|| {
    std::array::from_fn(|ray| {
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

    /// Reads the colours (blue, green, red, 0 to 255) of the nearest pixels from `start`, every
    /// `step` pixels of the disc's radius, until the ray leaves the image. Returns their number.
    pub(super) fn read_nearest(
        &self,
        ray: usize,
        start: f64,
        step: f64,
        colours: &mut [[f32; 3]],
    ) -> usize {
        let along = self.step(ray);
        let (mut point, step) = (self.centre + along * start, along * step);
        for (n, colour) in colours.iter_mut().enumerate() {
            let (u, v) = self.pixel(&point);
            let Some(seen) = self.image.at(u, v) else { return n };
            *colour = seen;
            point += step;
        }
        colours.len()
    }

    /// Reads the colours between pixels (bilinear). Returns `false`, and nothing of use is read, if
    /// the ray leaves the image.
    ///
    /// OpenCV's `remap` rounds places to 1/32 pixel (`INTER_BITS` is 5), too coarse for the edges.
    pub(super) fn read_bilinear<const N: usize>(
        &self,
        ray: usize,
        start: f64,
        step: f64,
        colours: &mut [[f32; 3]; N],
    ) -> bool {
        let along = self.step(ray);
        let (mut point, step) = (self.centre + along * start, along * step);
        let (width, height) = self.image.size();
        let bytes = self.image.pixels().as_flattened();
        let is_inside = |point: &Vector3<f64>| {
            let (u, v) = self.pixel(point);
            u >= 0.0 && v >= 0.0 && u < (width - 1) as f64 && v < (height - 1) as f64
        };
        // All points between two points in the image are in it, but for a fraction of a pixel with
        // a distortion: `last` bounds them.
        if !is_inside(&point) || !is_inside(&(point + step * (colours.len() - 1) as f64)) {
            return false;
        }
        let mut places = [(0.0, 0.0); N];
        for place in &mut places {
            *place = self.pixel(&point);
            point += step;
        }
        read_between(bytes, width, &places, colours);
        true
    }
}

/// Reads the colours at these places (column, row) between the pixels of an image, whose `bytes`
/// have `width` columns.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_between<const N: usize>(
    bytes: &[u8],
    width: usize,
    places: &[(f64, f64); N],
    colours: &mut [[f32; 3]; N],
) {
    // The last pair of pixels that has another pair below it.
    let last = bytes.len() - 3 * width - 6;
    for (colour, &(u, v)) in colours.iter_mut().zip(places) {
        let (column, row) = (u as u32, v as u32);
        let parts = ((u - f64::from(column)) as f32, (v - f64::from(row)) as f32);
        let at = (3 * (row as usize * width + column as usize)).min(last);
        let (upper, lower) = (&bytes[at..at + 6], &bytes[at + 3 * width..at + 3 * width + 6]);
        *colour = blend(upper, lower, parts);
    }
}

/// Returns the colour between two pixels (six bytes) and the two below them, at these parts of the
/// way to the right and down.
///
/// The bytes are written out, because the compiler leaves `std::array::from_fn` a call. Both rows
/// are mixed first, six bytes at a time.
#[inline(always)]
fn blend(upper: &[u8], lower: &[u8], (right, down): (f32, f32)) -> [f32; 3] {
    let mixed = |a: f32, b: f32, part: f32| a + (b - a) * part;
    let row = |k: usize| mixed(f32::from(upper[k]), f32::from(lower[k]), down);
    let [a, b, c, d, e, f] = [row(0), row(1), row(2), row(3), row(4), row(5)];
    [mixed(a, d, right), mixed(b, e, right), mixed(c, f, right)]
}
