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
        let mut places = [[0.0; RAYS]; 2];
        let (mut points, mut moves) = ([[0.0; RAYS]; 3], [[0.0; RAYS]; 3]);
        let inside = array::from_fn(|ray| {
            let along = self.step(ray);
            let (start, step) = (self.centre + along * starts[ray], along * steps[ray]);
            for axis in 0..3 {
                (points[axis][ray], moves[axis][ray]) = (start[axis], step[axis]);
            }
            // All points between two points in the image are in it, but for a fraction of a pixel
            // with a distortion.
            is_inside(&start) && is_inside(&(start + step * (N - 1) as f64))
        });
        for colours in colours {
            self.pixels(&points, &mut places);
            read_between(bytes, width, &places, colours);
            let pairs = points.as_flattened_mut().iter_mut().zip(moves.as_flattened());
            pairs.for_each(|(point, step)| *point += step);
        }
        inside
    }

    /// Writes columns and rows of a point on each ray.
    fn pixels(&self, points: &[[f64; RAYS]; 3], places: &mut [[f64; RAYS]; 2]) {
        if self.intrinsics.distortion.is_none() {
            divide(points, places);
            return;
        }
        for ray in 0..RAYS {
            let point = Vector3::from(points.map(|axis| axis[ray]));
            (places[0][ray], places[1][ray]) = self.pixel(&point);
        }
    }
}

/// Colours at a point on each ray, channel by channel: blue, green, red, 0 to 255.
pub(super) type RayColours = [[f32; RAYS]; 3];

/// Writes columns and rows of homogeneous points.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn divide([x, y, z]: &[[f64; RAYS]; 3], [columns, rows]: &mut [[f64; RAYS]; 2]) {
    for ray in 0..RAYS {
        let inverse = 1.0 / z[ray];
        (columns[ray], rows[ray]) = (x[ray] * inverse, y[ray] * inverse);
    }
}

/// A pixel and its right neighbour, for a place on each ray.
#[derive(Clone, Copy)]
struct Pairs {
    /// Four bytes from the left pixel on.
    left: [u32; RAYS],
    /// Four bytes to the end of the right pixel.
    right: [u32; RAYS],
}

impl Pairs {
    /// Reads the pair of a ray that starts at this byte.
    #[inline(always)]
    fn read(&mut self, ray: usize, bytes: &[u8], start: usize) {
        let pixels = &bytes[start..start + 6];
        self.left[ray] = u32::from_le_bytes(*pixels.first_chunk().unwrap_or(&[0; 4]));
        self.right[ray] = u32::from_le_bytes(*pixels.last_chunk().unwrap_or(&[0; 4]));
    }

    /// Returns a channel of both pixels of a ray.
    #[inline(always)]
    fn channel(&self, ray: usize, channel: u32) -> [f32; 2] {
        let byte = |bytes: u32, k: u32| (bytes >> (8 * k) & 255) as i32 as f32;
        [byte(self.left[ray], channel), byte(self.right[ray], channel + 1)]
    }
}

/// Reads the colours at these columns and rows between the pixels of an image, whose `bytes` have
/// `width` columns. A place outside is moved into the image.
///
/// The loops over the rays that compute are apart from the one that reads bytes, so that the
/// compiler computes many rays at once.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_between(
    bytes: &[u8],
    width: usize,
    [columns, rows]: &[[f64; RAYS]; 2],
    colours: &mut RayColours,
) {
    let (mut starts, mut rights, mut downs) = ([0; RAYS], [0.0; RAYS], [0.0; RAYS]);
    for ray in 0..RAYS {
        let (column, row) = (columns[ray] as i32, rows[ray] as i32);
        rights[ray] = (columns[ray] - f64::from(column)) as f32;
        downs[ray] = (rows[ray] - f64::from(row)) as f32;
        starts[ray] = row.wrapping_mul(width as i32).wrapping_add(column).wrapping_mul(3);
    }
    // The last pair of pixels that has another pair below it.
    let below = 3 * width;
    let last = bytes.len() - below - 6;
    let [mut upper, mut lower] = [Pairs { left: [0; RAYS], right: [0; RAYS] }; 2];
    for (ray, &start) in starts.iter().enumerate() {
        let start = usize::try_from(start).unwrap_or(0).min(last);
        upper.read(ray, bytes, start);
        lower.read(ray, bytes, start + below);
    }
    let mixed = |a: f32, b: f32, part: f32| a + (b - a) * part;
    for (channel, colours) in colours.iter_mut().enumerate() {
        for ray in 0..RAYS {
            let [above, below] = [&upper, &lower].map(|pairs| pairs.channel(ray, channel as u32));
            let left = mixed(above[0], below[0], downs[ray]);
            let right = mixed(above[1], below[1], downs[ray]);
            colours[ray] = mixed(left, right, rights[ray]);
        }
    }
}
