//! Clusters of coloured pixels whose depth ends where a ball would end.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Point3;

use super::super::likeness_map::LikenessMap;
use super::super::parameters::ClusterParameters;
use super::super::view::FrameView;
use super::sphere_fit::{ends, fit_sphere};

/// Unit vectors in the eight directions of the compass.
const DIRECTIONS: [(f64, f64); 8] = [
    (1.0, 0.0),
    (DIAGONAL, DIAGONAL),
    (0.0, 1.0),
    (-DIAGONAL, DIAGONAL),
    (-1.0, 0.0),
    (-DIAGONAL, -DIAGONAL),
    (0.0, -1.0),
    (DIAGONAL, -DIAGONAL),
];
const DIAGONAL: f64 = FRAC_1_SQRT_2;
/// Places in a likeness_map pixel, pixels from its centre, where depth is read. The first one with
/// depth counts.
const DEPTH_PLACES: [(f64, f64); 5] =
    [(0.5, 0.5), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)];

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
    if !view.has_depth() {
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
}

impl<'a> ClusterFinder<'a> {
    fn new(view: &'a FrameView<'a>, map: &'a LikenessMap) -> Self {
        let parameters = &view.parameters.clusters;
        let mut depths = Vec::with_capacity(map.values().len());
        map.each(|u, v, likeness| {
            let depth = || DEPTH_PLACES.iter().find_map(|(du, dv)| view.depth.at(u + du, v + dv));
            let coloured = likeness >= parameters.min_likeness / 2.0;
            depths.push(coloured.then(depth).flatten().unwrap_or(f64::INFINITY));
        });
        Self { view, map, parameters, depths }
    }

    /// Returns the clusters of pixels that may be near the middle of a ball.
    fn clusters(&self) -> Vec<Cluster> {
        let mut clusters = Vec::new();
        let mut depths = self.depths.iter();
        self.map.each(|u, v, likeness| {
            let coloured = likeness >= self.parameters.min_likeness;
            if let Some(&z) = depths.next().filter(|z| coloured && z.is_finite()) {
                self.add(DepthPixel { u, v, z }, likeness, &mut clusters);
            }
        });
        clusters
    }

    /// Adds a coloured pixel to its cluster if it may be near the middle of a ball.
    fn add(&self, pixel: DepthPixel, likeness: f32, clusters: &mut Vec<Cluster>) {
        let ball = self.view.ball_radius;
        let radius = self.view.radius_at(pixel.z + ball);
        // For a large ball a quarter of the pixels is enough.
        let is_large = radius > self.parameters.large_radius;
        let is_odd = |k: f64| (k / LikenessMap::FACTOR) as usize % 2 == 1;
        let is_skipped = is_large && (is_odd(pixel.u) || is_odd(pixel.v));
        let radii = self.parameters.min_radius..=self.parameters.max_radius;
        if is_skipped || !radii.contains(&radius) {
            return;
        }
        let Some(weight) = self.middle_weight(&pixel, likeness, radius) else { return };
        let weight = if is_large { 4.0 * weight } else { weight };
        let near = clusters.iter_mut().find(|Cluster { mean, .. }| {
            let (du, dv) = (mean.u - pixel.u, mean.v - pixel.v);
            (mean.z - pixel.z).abs() < ball && du.powi(2) + dv.powi(2) < radius * radius
        });
        match near {
            Some(cluster) => cluster.add(pixel, weight),
            None => clusters.push(Cluster { mean: pixel, weight }),
        }
    }

    /// Returns how clearly, up to 1, a coloured pixel is near the middle of a ball seen with
    /// `radius` pixels: the surface continues around it and has ended where a ball would have
    /// ended. Returns `None` if it does not.
    fn middle_weight(&self, pixel: &DepthPixel, likeness: f32, radius: f64) -> Option<f64> {
        let &DepthPixel { u, v, z } = pixel;
        let &ClusterParameters { min_likeness, same_object, beyond, .. } = self.parameters;
        let coloured = (same_object * likeness).max(min_likeness / 2.0);
        // The same object: coloured, and no farther behind than a ball reaches. A surface that
        // continues towards the camera has not ended.
        let continues = |(du, dv): (f64, f64), reach: f64| {
            self.map.index(u + reach * du, v + reach * dv).is_some_and(|i| {
                self.map.values()[i] >= coloured && self.depths[i] < z + self.view.ball_radius
            })
        };
        let min_within = self.parameters.min_within;
        let within = self.parameters.within * radius;
        let around = DIRECTIONS.iter().step_by(2).filter(|&&way| continues(way, within));
        if around.take(min_within).count() < min_within {
            return None;
        }
        let reach = beyond.at(radius);
        let most = DIRECTIONS.len() - self.parameters.min_ends + 1;
        let continued = DIRECTIONS.iter().filter(|&&way| continues(way, reach));
        let ended = most.checked_sub(continued.take(most).count())?;
        (ended > 0).then(|| ended as f64 / most as f64)
    }
}
