//! The rays on which a ball's outline is looked for.
//!
//! A sphere is seen as a cone, so its picture is a circle only on the optical axis and an ellipse
//! elsewhere. The rays are laid out on a plane across the direction to the ball: there the outline
//! is a circle wherever the ball is.

use nalgebra::Vector3;

use super::picture::{Disc, Picture};
use crate::image::Bgr;

/// Rays from a disc's middle.
pub(super) const RAYS: usize = 40;

/// Cosine and sine of the angle of each.
pub(super) fn directions() -> [(f64, f64); RAYS] {
    std::array::from_fn(|i| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / RAYS as f64).sin_cos();
        (cos, sin)
    })
}

/// The rays of a disc. Places are homogeneous pixel coordinates, so that they add up along a ray.
pub(super) struct Rays<'a> {
    picture: &'a Picture<'a>,
    /// The disc's middle.
    middle: Vector3<f64>,
    /// A pixel of the disc's radius to the right of it, and down.
    right: Vector3<f64>,
    down: Vector3<f64>,
}

impl Picture<'_> {
    /// The rays of `disc`.
    pub(super) fn rays(&self, disc: &Disc) -> Rays<'_> {
        let lens = self.intrinsics();
        let ahead = lens.deproject(disc.u, disc.v, 1.0).coords.normalize();
        let right = (Vector3::x() - ahead * ahead.x).normalize();
        let down = ahead.cross(&right);
        let homogeneous = |p: Vector3<f64>| {
            Vector3::new(lens.fx * p.x + lens.cx * p.z, lens.fy * p.y + lens.cy * p.z, p.z)
        };
        let pixel = ahead.z / lens.focal();
        let [middle, right, down] = [ahead, right * pixel, down * pixel].map(homogeneous);
        Rays { picture: self, middle, right, down }
    }
}

/// Column and row of a place.
#[inline]
fn pixel(place: &Vector3<f64>) -> (f64, f64) {
    let inverse = 1.0 / place.z;
    (place.x * inverse, place.y * inverse)
}

impl Rays<'_> {
    /// A pixel of the disc's radius on a ray.
    fn way(&self, ray: usize) -> Vector3<f64> {
        let (cos, sin) = self.picture.directions()[ray];
        self.right * cos + self.down * sin
    }

    /// Column and row of what a ray passes `off` pixels of the disc's radius from its middle;
    /// `None` behind the camera.
    pub(super) fn at(&self, ray: usize, off: f64) -> Option<(f64, f64)> {
        let place = self.middle + self.way(ray) * off;
        (place.z > 1e-9).then(|| pixel(&place))
    }

    /// The disc, of `radius`, moved by the first two components of `step` across the direction to
    /// it, and grown by the third, pixels.
    pub(super) fn moved(&self, radius: f64, step: &Vector3<f64>) -> Disc {
        let (u, v) = pixel(&(self.middle + self.right * step.x + self.down * step.y));
        Disc { u, v, radius: (radius + step.z).clamp(0.6 * radius, 1.6 * radius) }
    }

    /// Reads the colours (blue, green, red, 0 to 255) of the nearest pixels at every `step` pixels
    /// of the disc's radius, from `start` on, until the ray leaves the picture. How many they are.
    pub(super) fn colours(
        &self,
        ray: usize,
        start: f64,
        step: f64,
        colours: &mut [[f32; 3]],
    ) -> usize {
        let way = self.way(ray);
        let (mut place, step) = (self.middle + way * start, way * step);
        for (n, colour) in colours.iter_mut().enumerate() {
            let (u, v) = pixel(&place);
            let Some(seen) = self.picture.colour_at(u, v) else { return n };
            *colour = seen;
            place += step;
        }
        colours.len()
    }

    /// The same between pixels (bilinear). False, and nothing of use read, where the ray leaves the
    /// picture.
    pub(super) fn blended(
        &self,
        ray: usize,
        start: f64,
        step: f64,
        colours: &mut [[f32; 3]],
    ) -> bool {
        let way = self.way(ray);
        let (mut place, step) = (self.middle + way * start, way * step);
        let (width, height) = self.picture.size();
        let pixels = self.picture.pixels();
        let inside = |place: &Vector3<f64>| {
            let (u, v) = pixel(place);
            u >= 0.0 && v >= 0.0 && u < (width - 1) as f64 && v < (height - 1) as f64
        };
        // What is between two places in the picture is in it.
        if !inside(&place) || !inside(&(place + step * (colours.len() - 1) as f64)) {
            return false;
        }
        for colour in colours {
            let (u, v) = pixel(&place);
            place += step;
            let (column, row) = (u as u32, v as u32);
            let parts = ((u - f64::from(column)) as f32, (v - f64::from(row)) as f32);
            let at = (row as usize * width + column as usize).min(pixels.len() - width - 2);
            *colour = blend(&pixels[at..at + 2], &pixels[at + width..at + width + 2], parts);
        }
        true
    }
}

/// The colour between two pixels and the two below them, at these parts of the way to the right and
/// down.
#[inline]
fn blend(upper: &[Bgr], lower: &[Bgr], (right, down): (f32, f32)) -> [f32; 3] {
    let line = |pixels: &[Bgr]| -> [f32; 3] {
        let (a, b) = (pixels[0].map(f32::from), pixels[1].map(f32::from));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * right)
    };
    let (a, b) = (line(upper), line(lower));
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * down)
}
