//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Point3;

use super::super::parameters::ClusterParameters;
use super::super::view::FrameView;
use super::cell_map::{Cell, CellMap};
use super::sphere_fit::{ends, fit_sphere};

/// A pixel with depth.
#[derive(Debug, Clone, Copy)]
struct DepthPixel {
    /// Column, pixels.
    u: f64,
    /// Row, pixels.
    v: f64,
    /// Depth, metres.
    z: f64,
}

/// A cluster of pixels that may be the middle of one ball.
#[derive(Debug, Clone, Copy)]
struct Cluster {
    mean: DepthPixel,
    /// Sum of the pixels' weights.
    weight: f64,
}

impl Cluster {
    /// Adds a pixel.
    fn add(&mut self, pixel: DepthPixel, weight: f64) {
        self.weight += weight;
        let part = weight / self.weight;
        self.mean.u += (pixel.u - self.mean.u) * part;
        self.mean.v += (pixel.v - self.mean.v) * part;
        self.mean.z += (pixel.z - self.mean.z) * part;
    }

    /// Returns the part of a ball's middle that is in the cluster, up to a factor.
    fn share(&self) -> f64 {
        self.weight * self.mean.z.powi(2)
    }
}

/// Finds the spheres that may be the ball (centres in camera axes, metres), the best first.
pub(in super::super) fn find_spheres(view: &FrameView) -> Vec<Point3<f64>> {
    if !view.has_depth {
        return Vec::new();
    }
    let mut clusters = find_clusters(view);
    clusters.sort_by(|a, b| b.share().total_cmp(&a.share()));
    let fitted = clusters
        .iter()
        .take(view.parameters.clusters.max_clusters)
        .filter_map(|Cluster { mean, .. }| fit_sphere(view, mean.u, mean.v, mean.z));
    let mut spheres: Vec<(Point3<f64>, f64)> =
        fitted.map(|sphere| (sphere.centre, sphere.filled * ends(view, &sphere.centre))).collect();
    spheres.sort_by(|a, b| b.1.total_cmp(&a.1));
    let least = view.parameters.sphere.min_quality;
    spheres.into_iter().filter(|sphere| sphere.1 > least).map(|sphere| sphere.0).collect()
}

/// Returns the clusters of cells that may be near the middle of a ball.
fn find_clusters(view: &FrameView) -> Vec<Cluster> {
    let parameters = &view.parameters.clusters;
    let mut map = CellMap::new(view);
    // The surface of a ball is nearer than its centre by the ball's radius.
    let surface = |radius| view.intrinsics().depth_of(view.ball_radius, radius) - view.ball_radius;
    let radii = view.possible_radii();
    let depths = surface(radii.end) as f32..surface(radii.start) as f32;
    let coloured = map.coloured(view, parameters.min_likeness, &depths);
    let finder = ClusterFinder { view, map, parameters };
    let mut clusters = Vec::new();
    coloured.into_iter().for_each(|place| finder.add(place, &mut clusters));
    clusters
}

/// The cells of a window, and which clusters a ball can be.
struct ClusterFinder<'a> {
    view: &'a FrameView<'a>,
    map: CellMap,
    parameters: &'a ClusterParameters,
}

impl ClusterFinder<'_> {
    /// Adds the coloured cell at column `x`, row `y` to its cluster if it may be near the middle of
    /// a ball.
    fn add(&self, (x, y): (usize, usize), clusters: &mut Vec<Cluster>) {
        let cell = self.map.at(x as i32, y as i32);
        let ((u, v), z) = (self.map.to_full(x, y), f64::from(cell.depth));
        let (centre, ball) = (DepthPixel { u, v, z }, self.view.ball_radius);
        let radius = self.view.radius_at(centre.z + ball);
        // For a large ball a quarter of the cells is enough.
        let is_large = radius > self.parameters.large_radius;
        let is_skipped = is_large && (!x.is_multiple_of(2) || !y.is_multiple_of(2));
        if is_skipped {
            return;
        }
        let Some(weight) = self.middle_weight((x as i32, y as i32), cell, radius) else { return };
        let weight = if is_large { 4.0 * weight } else { weight };
        // The last clusters are the nearest ones.
        let near = clusters.iter_mut().rev().find(|Cluster { mean, .. }| {
            let (du, dv) = (mean.u - centre.u, mean.v - centre.v);
            (mean.z - centre.z).abs() < ball && du.powi(2) + dv.powi(2) < radius * radius
        });
        match near {
            Some(cluster) => cluster.add(centre, weight),
            None => clusters.push(Cluster { mean: centre, weight }),
        }
    }

    /// Returns how clearly, up to 1, the coloured cell at (`x`, `y`) is near the middle of
    /// a ball seen with `radius` pixels: the surface continues around it and has ended where a
    /// ball would have ended. Returns `None` if it does not.
    fn middle_weight(&self, (x, y): (i32, i32), cell: &Cell, radius: f64) -> Option<f64> {
        let &ClusterParameters {
            min_likeness,
            same_object,
            within,
            min_within,
            beyond,
            min_ends,
            ..
        } = self.parameters;
        let coloured = (same_object * cell.likeness).max(min_likeness / 2.0);
        let end = cell.depth + self.view.ball_radius as f32;
        // The same object: coloured, and no farther behind than a ball reaches. A surface that
        // continues towards the camera has not ended.
        let continues = |&&(dx, dy): &&(i32, i32)| {
            let cell = self.map.at(x + dx, y + dy);
            cell.likeness >= coloured && cell.depth < end
        };
        // Most cells are on a surface that has not ended: that is found out first.
        let beyond = circle(beyond.at(radius));
        let most = beyond.len() - min_ends + 1;
        let continued = beyond.iter().filter(continues).take(most).count();
        if continued == most {
            return None;
        }
        let within = circle(within * radius);
        let around = within.iter().step_by(2).filter(continues).take(min_within).count();
        (around == min_within).then(|| (most - continued) as f64 / most as f64)
    }
}

/// Returns the columns and rows from a pixel of the likeness map to those in the eight directions
/// of the compass, `reach` pixels of the full image from its centre. Every second one is in a
/// straight direction.
fn circle(reach: f64) -> [(i32, i32); 8] {
    // A cast rounds towards 0, which rounds down as long as the number is not negative.
    const ABOVE_ZERO: i32 = 1 << 16;
    let steps = |reach: f64| {
        let place = 0.5 + f64::from(ABOVE_ZERO) + reach / CellMap::FACTOR;
        place as i32 - ABOVE_ZERO
    };
    let (back, on) = (steps(-reach), steps(reach));
    let (up, down) = (steps(-reach * FRAC_1_SQRT_2), steps(reach * FRAC_1_SQRT_2));
    [(on, 0), (down, down), (0, on), (up, down), (back, 0), (up, up), (0, back), (down, up)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_lead_to_the_pixels_in_which_the_places_on_the_circle_are() {
        for reach in [0.0, 1.9, 2.0, 2.1, 7.3, 40.0, 611.0] {
            for (i, step) in circle(reach).into_iter().enumerate() {
                let (sin, cos) = (i as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
                // The centre of a pixel is half a pixel from its border.
                let place = |part: f64| (0.5 + part * reach / CellMap::FACTOR + 1e-9).floor();
                assert_eq!(step, (place(cos) as i32, place(sin) as i32), "{reach}, {i}");
            }
        }
    }
}
