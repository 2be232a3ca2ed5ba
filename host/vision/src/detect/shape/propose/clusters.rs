//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Point3;

use super::super::likeness_map::LikenessMap;
use super::super::parameters::ClusterParameters;
use super::super::view::FrameView;
use super::sphere_fit::{ends, fit_sphere};

/// Places in a pixel of the likeness map, column and row from its first one, where depth is read.
/// The first one with depth counts.
const DEPTH_PLACES: [(usize, usize); 5] = [(2, 2), (1, 1), (3, 3), (1, 3), (3, 1)];

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

/// A pixel of the likeness map with depth.
#[derive(Debug, Clone, Copy)]
struct MapPixel {
    /// Column and row in the map.
    x: i32,
    y: i32,
    /// Likeness to the ball's colour, 0 to 1.
    likeness: f32,
    /// Its centre in the full image.
    centre: DepthPixel,
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

/// The likeness map with the depth of its coloured pixels.
struct ClusterFinder<'a> {
    view: &'a FrameView<'a>,
    map: &'a LikenessMap,
    parameters: &'a ClusterParameters,
    /// Depth of each coloured pixel, metres; infinite for others and where it is unknown.
    depths: Vec<f64>,
    /// The pixels of clear colour with depth.
    pixels: Vec<MapPixel>,
}

impl<'a> ClusterFinder<'a> {
    fn new(view: &'a FrameView<'a>, map: &'a LikenessMap) -> Self {
        let parameters = &view.parameters.clusters;
        let mut depths = vec![f64::INFINITY; map.values().len()];
        let mut pixels = Vec::new();
        for (x, y) in map.coloured(parameters.min_likeness / 2.0) {
            let (column, row) = map.first(x, y);
            let at = |&(dx, dy): &(usize, usize)| view.depth.at_pixel(column + dx, row + dy);
            let ((u, v), [x, y]) = (map.to_full(x, y), [x, y].map(|k| k as i32));
            let z = DEPTH_PLACES.iter().find_map(at);
            let (Some(z), Some(index)) = (z, map.index(x, y)) else { continue };
            depths[index] = z;
            let likeness = map.values()[index];
            if likeness >= parameters.min_likeness {
                pixels.push(MapPixel { x, y, likeness, centre: DepthPixel { u, v, z } });
            }
        }
        Self { view, map, parameters, depths, pixels }
    }

    /// Returns the clusters of pixels that may be near the middle of a ball.
    fn clusters(&self) -> Vec<Cluster> {
        let mut clusters = Vec::new();
        self.pixels.iter().for_each(|pixel| self.add(pixel, &mut clusters));
        clusters
    }

    /// Adds a coloured pixel to its cluster if it may be near the middle of a ball.
    fn add(&self, pixel: &MapPixel, clusters: &mut Vec<Cluster>) {
        let (centre, ball) = (pixel.centre, self.view.ball_radius);
        let radius = self.view.radius_at(centre.z + ball);
        // For a large ball a quarter of the pixels is enough.
        let is_large = radius > self.parameters.large_radius;
        let is_odd = |k: f64| (k / LikenessMap::FACTOR) as usize % 2 == 1;
        let is_skipped = is_large && (is_odd(centre.u) || is_odd(centre.v));
        let radii = self.parameters.min_radius..=self.parameters.max_radius;
        if is_skipped || !radii.contains(&radius) {
            return;
        }
        let Some(weight) = self.middle_weight(pixel, radius) else { return };
        let weight = if is_large { 4.0 * weight } else { weight };
        let near = clusters.iter_mut().find(|Cluster { mean, .. }| {
            let (du, dv) = (mean.u - centre.u, mean.v - centre.v);
            (mean.z - centre.z).abs() < ball && du.powi(2) + dv.powi(2) < radius * radius
        });
        match near {
            Some(cluster) => cluster.add(centre, weight),
            None => clusters.push(Cluster { mean: centre, weight }),
        }
    }

    /// Returns how clearly, up to 1, a coloured pixel is near the middle of a ball seen with
    /// `radius` pixels: the surface continues around it and has ended where a ball would have
    /// ended. Returns `None` if it does not.
    fn middle_weight(&self, pixel: &MapPixel, radius: f64) -> Option<f64> {
        let &ClusterParameters { min_likeness, same_object, beyond, .. } = self.parameters;
        let coloured = (same_object * pixel.likeness).max(min_likeness / 2.0);
        let end = pixel.centre.z + self.view.ball_radius;
        // The same object: coloured, and no farther behind than a ball reaches. A surface that
        // continues towards the camera has not ended.
        let continues = |dx, dy| {
            let index = self.map.index(pixel.x + dx, pixel.y + dy);
            index.is_some_and(|i| self.map.values()[i] >= coloured && self.depths[i] < end)
        };
        let within = circle(self.parameters.within * radius);
        let mut around = 0;
        for &(dx, dy) in within.iter().step_by(2) {
            around += usize::from(continues(dx, dy));
        }
        if around < self.parameters.min_within {
            return None;
        }
        let beyond = circle(beyond.at(radius));
        let most = beyond.len() - self.parameters.min_ends + 1;
        let mut ended = most;
        for (dx, dy) in beyond {
            ended -= usize::from(continues(dx, dy));
            if ended == 0 {
                return None;
            }
        }
        Some(ended as f64 / most as f64)
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
