//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::Range;

use nalgebra::Point3;

use super::super::likeness_map::LikenessMap;
use super::super::parameters::ClusterParameters;
use super::super::view::FrameView;
use super::sphere_fit::{ends, fit_sphere};

/// Places in a pixel of the likeness map, column and row from its first one, where depth is read if
/// it is unknown in the middle. The first one with depth counts. They are in the row of the middle,
/// which the processor has at hand.
const OTHER_PLACES: [(usize, usize); 3] = [(1, 2), (3, 2), (0, 2)];

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

/// Likeness to the ball's colour, 0 to 1, and depth of a pixel of the likeness map.
#[derive(Debug, Clone, Copy)]
struct Cell {
    likeness: f32,
    /// Metres; infinite where it is unknown.
    depth: f32,
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
    let map = LikenessMap::new(&view.levels[2], view.colour.ball());
    let finder = ClusterFinder::new(view, &map);
    let mut clusters = finder.clusters();
    clusters.sort_by(|a, b| b.share().total_cmp(&a.share()));
    let fitted = clusters
        .iter()
        .take(finder.parameters.max_clusters)
        .filter_map(|Cluster { mean, .. }| fit_sphere(view, mean.u, mean.v, mean.z));
    let mut spheres: Vec<(Point3<f64>, f64)> =
        fitted.map(|sphere| (sphere.centre, sphere.filled * ends(view, &sphere.centre))).collect();
    spheres.sort_by(|a, b| b.1.total_cmp(&a.1));
    let least = view.parameters.sphere.min_quality;
    spheres.into_iter().filter(|sphere| sphere.1 > least).map(|sphere| sphere.0).collect()
}

/// The likeness map with depth.
struct ClusterFinder<'a> {
    view: &'a FrameView<'a>,
    map: &'a LikenessMap,
    parameters: &'a ClusterParameters,
    /// Radii that the ball can have, pixels.
    possible_radii: Range<f64>,
    /// The pixels of the map, row by row, and one for all places outside.
    cells: Vec<Cell>,
    /// Column and row in the map of the pixels of clear colour with depth.
    coloured: Vec<(usize, usize)>,
}

impl<'a> ClusterFinder<'a> {
    fn new(view: &'a FrameView<'a>, map: &'a LikenessMap) -> Self {
        let possible_radii = view.possible_radii(1.0 + view.parameters.search.radius_margin);
        let parameters = &view.parameters.clusters;
        let (cells, coloured) = (Vec::with_capacity(map.values().len() + 1), Vec::new());
        let mut finder = Self { view, map, parameters, possible_radii, cells, coloured };
        finder.read_cells();
        finder
    }

    /// Reads the pixels of the map, and notes those of clear colour with depth.
    fn read_cells(&mut self) {
        let (view, map, least) = (self.view, self.map, self.parameters.min_likeness);
        let scale = view.intrinsics().depth_scale as f32;
        self.cells.extend(map.values().iter().zip(&view.small_depth).map(|(&likeness, &raw)| {
            let depth = if raw == 0 { f32::INFINITY } else { f32::from(raw) / scale };
            Cell { likeness, depth }
        }));
        for (y, row) in self.cells.chunks_exact_mut(map.width()).enumerate() {
            for (x, cell) in row.iter_mut().enumerate() {
                if cell.likeness < least / 2.0 {
                    continue;
                }
                if cell.depth == f32::INFINITY {
                    let (column, row) = map.first(x, y);
                    let at = |&(dx, dy): &_| view.depth.at_pixel(column + dx, row + dy);
                    let Some(z) = OTHER_PLACES.iter().find_map(at) else { continue };
                    cell.depth = z as f32;
                }
                if cell.likeness >= least {
                    self.coloured.push((x, y));
                }
            }
        }
        self.cells.push(Cell { likeness: 0.0, depth: f32::INFINITY });
    }

    /// Returns the clusters of pixels that may be near the middle of a ball.
    fn clusters(&self) -> Vec<Cluster> {
        let mut clusters = Vec::new();
        self.coloured.iter().for_each(|&pixel| self.add(pixel, &mut clusters));
        clusters
    }

    /// Adds the coloured pixel at column `x`, row `y` of the map to its cluster if it may be near
    /// the middle of a ball.
    fn add(&self, (x, y): (usize, usize), clusters: &mut Vec<Cluster>) {
        let cell = self.cell(x as i32, y as i32);
        let ((u, v), z) = (self.map.to_full(x, y), f64::from(cell.depth));
        let (centre, ball) = (DepthPixel { u, v, z }, self.view.ball_radius);
        let radius = self.view.radius_at(centre.z + ball);
        // For a large ball a quarter of the pixels is enough.
        let is_large = radius > self.parameters.large_radius;
        let is_skipped = is_large && (!x.is_multiple_of(2) || !y.is_multiple_of(2));
        if is_skipped || !self.possible_radii.contains(&radius) {
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

    /// Returns the pixel at column `x`, row `y` of the map; the last one outside.
    #[inline]
    fn cell(&self, x: i32, y: i32) -> &Cell {
        &self.cells[self.map.index(x, y).unwrap_or(self.cells.len() - 1)]
    }

    /// Returns how clearly, up to 1, the coloured pixel `cell` at (`x`, `y`) is near the middle of
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
            let cell = self.cell(x + dx, y + dy);
            cell.likeness >= coloured && cell.depth < end
        };
        let within = circle(within * radius);
        let around = within.iter().step_by(2).filter(continues).take(min_within).count();
        if around < min_within {
            return None;
        }
        let beyond = circle(beyond.at(radius));
        let most = beyond.len() - min_ends + 1;
        let continued = beyond.iter().filter(continues).take(most).count();
        (continued < most).then(|| (most - continued) as f64 / most as f64)
    }
}

/// Returns the columns and rows from a pixel of the likeness map to those in the eight directions
/// of the compass, `reach` pixels of the full image from its centre. Every second one is in a
/// straight direction.
fn circle(reach: f64) -> [(i32, i32); 8] {
    // A cast rounds towards 0, which rounds down as long as the number is not negative.
    const ABOVE_ZERO: i32 = 1 << 16;
    let steps = |reach: f64| {
        let place = 0.5 + f64::from(ABOVE_ZERO) + reach / LikenessMap::FACTOR;
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
                let place = |part: f64| (0.5 + part * reach / LikenessMap::FACTOR + 1e-9).floor();
                assert_eq!(step, (place(cos) as i32, place(sin) as i32), "{reach}, {i}");
            }
        }
    }
}
