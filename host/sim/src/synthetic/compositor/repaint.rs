//! New paint on recorded surfaces, which keep their depth and their shading.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::Compositor;
use crate::synthetic::room::Pattern;

/// Depth of the pattern on pixels without depth, metres.
const UNKNOWN_DEPTH: f64 = 1.5;
/// Least and greatest brightness of a recorded pixel over the region's mean.
const SHADING: [f32; 2] = [0.25, 2.0];

/// Paint on a region of the recorded surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Its colour, linear, order blue, green, red.
    pub colour: [f64; 3],
    /// Variation of its colour over the surfaces.
    pub pattern: Pattern,
    /// Rotation of the pattern against the camera's axes.
    pub turn: UnitQuaternion<f64>,
    /// Middle of the region, pixels.
    pub centre: (f64, f64),
    /// Radius of the region, pixels, ±30 % along its wavy edge; infinity = the whole frame.
    pub radius: f64,
}

impl Compositor {
    /// Paints the recorded surfaces in a region. Their depth and shading stay; composited objects
    /// keep their colours.
    pub fn repaint(&mut self, paint: &Paint) {
        let inside: Vec<usize> = (0..self.colour.len())
            .filter(|&i| !self.covered[i] && paint.covers(self.pixel_at(i)))
            .collect();
        let sum: f32 = inside.iter().map(|&i| luminance(&self.colour[i])).sum();
        let mean = sum / inside.len().max(1) as f32;
        for i in inside {
            let [least, greatest] = SHADING;
            let shading = (luminance(&self.colour[i]) / mean.max(1e-4)).clamp(least, greatest);
            let colour = paint.pattern.colour(paint.colour, paint.turn * self.surface_at(i).coords);
            self.colour[i] = colour.map(|x| x as f32 * shading);
        }
    }

    /// Returns column and row of a pixel.
    fn pixel_at(&self, i: usize) -> (f64, f64) {
        ((i % self.width) as f64, (i / self.width) as f64)
    }

    /// Returns the surface point of a pixel in camera axes, metres.
    fn surface_at(&self, i: usize) -> Point3<f64> {
        let (u, v) = self.pixel_at(i);
        let z = f64::from(self.depth[i]);
        self.lens().deproject(u, v, if z > 0.0 { z } else { UNKNOWN_DEPTH })
    }
}

impl Paint {
    /// Returns whether the region contains a pixel.
    fn covers(&self, (u, v): (f64, f64)) -> bool {
        let (x, y) = (u - self.centre.0, v - self.centre.1);
        let angle = y.atan2(x);
        let waves = 0.2 * (3.0 * angle + self.radius).sin() + 0.1 * (7.0 * angle).sin();
        self.radius.is_infinite() || x.hypot(y) < self.radius * (1.0 + waves)
    }
}

/// Returns the brightness of a linear colour (blue, green, red).
fn luminance(colour: &[f32; 3]) -> f32 {
    let weights = Vector3::new(0.07, 0.72, 0.21);
    Vector3::from(*colour).dot(&weights)
}
