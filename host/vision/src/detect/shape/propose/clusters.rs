//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Point3;

use super::super::parameters::ClusterParameters;
use super::super::view::FrameView;
use super::cell_map::{CellMap, Step};
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
    let (map, parameters) = (CellMap::new(view), &view.parameters.clusters);
    let mut finder = ClusterFinder { view, map: &map, parameters, clusters: Vec::new() };
    map.reaches().enumerate().for_each(|(y, reaches)| finder.add_row(y, reaches));
    finder.clusters
}

/// The cells of a window, and the clusters in it.
struct ClusterFinder<'a> {
    view: &'a FrameView<'a>,
    map: &'a CellMap,
    parameters: &'a ClusterParameters,
    clusters: Vec<Cluster>,
}

impl ClusterFinder<'_> {
    /// Adds the cells of row `y` that may be near the middle of a ball to their clusters: the
    /// surface continues around them, and has ended at their reach. `reaches` are those of the row.
    fn add_row(&mut self, y: usize, reaches: &[f32]) {
        // Cells of one reach have the same steps to their neighbours, and are looked at together.
        let mut present = reaches.iter().fold(0_u64, |all, &reach| all | 1 << reach as u32) & !1;
        if present == 0 {
            return;
        }
        let most = (DIRECTIONS - self.parameters.min_ends + 1) as f32;
        let mut continued = vec![0.0; reaches.len()];
        while present != 0 {
            self.count_continued(&mut continued, y, present.trailing_zeros() as f32);
            present &= present - 1;
        }
        for (x, (continued, &reach)) in continued.into_iter().zip(reaches).enumerate() {
            let is_read = reach > 0.0 && self.is_read(x, reach) && self.is_read(y, reach);
            // Most cells are on a surface that has not ended: that is found out first.
            if continued < most && is_read && self.continues_within(x, y) {
                let cells = if self.is_large(reach) { 4.0 } else { 1.0 };
                self.add(x, y, f64::from(cells * (most - continued) / most));
            }
        }
    }

    /// Adds the number of directions in which the surface continues at the cell's reach to the
    /// count of each cell of row `y` that has this `reach` and is read.
    fn count_continued(&self, counts: &mut [f32], y: usize, reach: f32) {
        if self.is_read(y, reach) {
            let add = |step| self.map.add_continued(counts, y, reach, step);
            circle(f64::from(reach)).into_iter().for_each(add);
        }
    }

    /// Checks whether column or row `k` is read for balls that have ended at `reach`: for large
    /// ones a quarter of the cells is enough.
    fn is_read(&self, k: usize, reach: f32) -> bool {
        k.is_multiple_of(2) || !self.is_large(reach)
    }

    /// Checks whether balls that have ended at `reach` are large.
    fn is_large(&self, reach: f32) -> bool {
        let ClusterParameters { beyond, large_radius, .. } = self.parameters;
        f64::from(reach) * CellMap::FACTOR >= beyond.at(*large_radius)
    }

    /// Checks whether the surface of the cell at column `x`, row `y` continues within a ball.
    fn continues_within(&self, x: usize, y: usize) -> bool {
        let &ClusterParameters { within, min_within, .. } = self.parameters;
        let directions = circle(within * self.radius(x, y) / CellMap::FACTOR);
        let straight = directions.into_iter().step_by(2);
        straight.filter(|step| self.map.continues(x, y, *step)).count() >= min_within
    }

    /// Returns the radius (pixels) of a ball whose surface is in the cell at column `x`, row `y`.
    fn radius(&self, x: usize, y: usize) -> f64 {
        self.view.radius_at(self.map.depth(x, y) + self.view.ball_radius)
    }

    /// Adds the cell at column `x`, row `y` to its cluster.
    fn add(&mut self, x: usize, y: usize, weight: f64) {
        let ((u, v), z, radius) = (self.map.to_full(x, y), self.map.depth(x, y), self.radius(x, y));
        // The last clusters are the nearest ones.
        let near = self.clusters.iter_mut().rev().find(|Cluster { mean, .. }| {
            let (du, dv) = (mean.u - u, mean.v - v);
            (mean.z - z).abs() < self.view.ball_radius && du.powi(2) + dv.powi(2) < radius * radius
        });
        let pixel = DepthPixel { u, v, z };
        match near {
            Some(cluster) => cluster.add(pixel, weight),
            None => self.clusters.push(Cluster { mean: pixel, weight }),
        }
    }
}

/// Number of the directions of the compass.
const DIRECTIONS: usize = 8;

/// Returns the columns and rows from a cell to those in the directions of the compass, `reach`
/// cells away. Every second one is in a straight direction.
fn circle(reach: f64) -> [Step; DIRECTIONS] {
    let [on, across] = [reach, reach * FRAC_1_SQRT_2].map(|reach| (reach + 0.5) as isize);
    [
        (on, 0),
        (across, across),
        (0, on),
        (-across, across),
        (-on, 0),
        (-across, -across),
        (0, -on),
        (across, -across),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_lead_to_the_cells_nearest_to_the_circle() {
        for reach in [0.0, 0.4, 0.6, 2.0, 3.0, 28.0, 153.0] {
            for (i, step) in circle(reach).into_iter().enumerate() {
                let (sin, cos) = (i as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
                let nearest = |part: f64| (part * reach).round() as isize;
                assert_eq!(step, (nearest(cos), nearest(sin)), "{reach}, {i}");
            }
        }
    }
}
