//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;
use std::iter;

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
    let large_reach = (parameters.beyond.at(parameters.large_radius) / CellMap::FACTOR) as f32;
    let clusters = Vec::new();
    let mut finder = ClusterFinder { view, map: &map, parameters, large_reach, clusters };
    map.reaches().enumerate().for_each(|(y, reaches)| finder.add_row(y, reaches));
    finder.clusters
}

/// The cells of a window, and the clusters in it.
struct ClusterFinder<'a> {
    view: &'a FrameView<'a>,
    map: &'a CellMap,
    parameters: &'a ClusterParameters,
    /// Least reach of large balls, of which a quarter of the cells is enough, cells.
    large_reach: f32,
    clusters: Vec<Cluster>,
}

impl ClusterFinder<'_> {
    /// Adds the cells of row `y` that may be near the middle of a ball to their clusters: the
    /// surface continues around them, and has ended at their reach. `reaches` are those of the row.
    fn add_row(&mut self, y: usize, reaches: &[f32]) {
        let mut present = distinct(reaches).peekable();
        if present.peek().is_none() {
            return;
        }
        let most = (DIRECTIONS - self.parameters.min_ends + 1) as f32;
        let mut continued = vec![0.0; reaches.len()];
        // Cells of one reach have the same steps to their neighbours, and are looked at together.
        for reach in present.filter(|reach| self.is_read(y, *reach)) {
            let add = |step| self.map.add_continued(&mut continued, y, reach, step);
            circle(f64::from(reach)).into_iter().for_each(add);
        }
        for (x, (continued, &reach)) in continued.into_iter().zip(reaches).enumerate() {
            let is_read = reach > 0.0 && self.is_read(x, reach) && self.is_read(y, reach);
            // Most cells are on a surface that has not ended: that is found out first.
            if continued < most && is_read && self.continues_within(x, y) {
                let cells = if reach >= self.large_reach { 4.0 } else { 1.0 };
                self.add(x, y, f64::from(cells * (most - continued) / most));
            }
        }
    }

    /// Checks whether column or row `k` is read for balls of this reach.
    fn is_read(&self, k: usize, reach: f32) -> bool {
        k.is_multiple_of(2) || reach < self.large_reach
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

/// Returns each of `reaches` but 0 once, the smallest first.
fn distinct(reaches: &[f32]) -> impl Iterator<Item = f32> {
    // A bit for each reach. The lowest one is cleared after its turn.
    let all = reaches.iter().fold(0_u64, |all, &reach| all | 1 << reach as u32) & !1;
    let left = iter::successors(Some(all), |left| Some(left & left.checked_sub(1)?));
    left.take_while(|left| *left != 0).map(|left| left.trailing_zeros() as f32)
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
    fn a_reach_comes_once_and_0_does_not_come() {
        let reaches = [0.0, 63.0, 2.0, 0.0, 2.0, 1.0, 63.0];
        assert_eq!(distinct(&reaches).collect::<Vec<_>>(), [1.0, 2.0, 63.0]);
        assert_eq!(distinct(&[0.0; 3]).count(), 0);
    }

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
