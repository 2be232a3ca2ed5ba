//! Irradiance in a room: ambient light with occlusion, area lights with soft shadows.

use nalgebra::{Point3, Vector3};

use super::RayCaster;
use crate::synthetic::room::shape::{Ray, wall};
use crate::synthetic::room::{AreaLight, Object};

/// Distance within which objects occlude ambient light, metres.
const OCCLUSION_DISTANCE: f64 = 0.5;

impl RayCaster<'_> {
    /// Returns whether an object occludes `ray` before `t` = `end`.
    pub(super) fn is_occluded(&self, ray: &Ray, end: f64) -> bool {
        let occludes = |_, object: &Object| {
            let at = object.shape.intersect(ray).filter(|_| object.glow <= 0.0)?;
            (at.t < end).then_some(())
        };
        self.find((ray, ray.along.norm(), end), occludes).is_some()
    }

    /// Returns the ambient visibility at `from`: 1 in the open, less in corners and under objects.
    pub(super) fn ambient_visibility(
        &self,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        random: &impl Fn(i64) -> f64,
    ) -> f64 {
        let mut open = 0.0;
        for sample in 0..3 {
            let z = 2.0 * random(2 * sample) - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * random(2 * sample + 1)).sin_cos();
            let flat = (1.0 - z * z).max(0.0).sqrt();
            // A random point on a sphere that touches the surface gives a cosine-weighted
            // direction.
            let along = normal + Vector3::new(flat * cos, flat * sin, z);
            let ray = Ray { from: *from, along: along.try_normalize(1e-9).unwrap_or(*normal) };
            let free = (wall(&ray, &self.low, &self.high).t / OCCLUSION_DISTANCE).min(1.0);
            open +=
                if self.is_occluded(&ray, OCCLUSION_DISTANCE) { 0.15 } else { 0.35 + 0.65 * free };
        }
        // More ambient light comes from above than from below.
        open / 3.0 * (0.85 + 0.15 * normal.z)
    }

    /// Returns the share of the light of `panel` that arrives at `from` from its point at `place`
    /// (0 to 1 along both edges).
    pub(super) fn panel(
        &self,
        panel: &AreaLight,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        place: [f64; 2],
    ) -> f64 {
        let source =
            panel.centre + panel.a * (2.0 * place[0] - 1.0) + panel.b * (2.0 * place[1] - 1.0);
        let to = source - from;
        let distance = to.norm();
        let out = panel.a.cross(&panel.b).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let facing = normal.dot(&to) / distance;
        let leaving = -out.dot(&to) / distance;
        if facing <= 0.0
            || leaving <= 0.0
            || self.is_occluded(&Ray { from: *from, along: to }, 0.995)
        {
            return 0.0;
        }
        // The light falls off more slowly than 1/d², as walls reflect it.
        facing * (0.3 + 0.7 * leaving) / (1.0 + distance * distance)
    }
}
