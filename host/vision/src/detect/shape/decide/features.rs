//! Features of a disc, which the classifier weights.

use super::super::disc_depth::{DiscPlace, places};
use super::super::radial_scan::RAYS;
use super::super::refine::{Boundary, Outline, RefinedCircle, Surroundings, fit_edges};
use super::super::view::{Disc, FrameView};
use super::curvature::{Curvature, SphereMatch, curvature, match_sphere};

/// Square of the largest distance from the centre, in the radius, at which a disc without depth is
/// checked for depth behind it.
const THROUGH_SQUARE: f64 = 0.4;
/// Parts of a disc, in a row and in a column, whose brightness is compared.
const SHADING_PARTS: usize = 3;
/// Places that a part needs more than.
const MIN_PART_PLACES: f32 = 2.0;
/// Parts that shading needs more than.
const MIN_PARTS: f32 = 4.0;

/// Features of a disc with depth, but for those of its free fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthFeatures {
    /// Part of the visible rays with an attached object of another colour.
    pub attached: f64,
    /// Part of the visible rays with an attached object of the ball's colour.
    pub continued: f64,
    /// Part of the visible rays covered by an object of the ball's colour.
    pub covered_alike: f64,
    /// Part of the visible rays on which the ball's colour continues without an end.
    pub continues: f64,
    /// Likeness to the ball's colour, 0 to 1.
    pub likeness: f64,
    /// Curvature of the surface; `None` if too little of it has depth.
    pub curvature: Option<Curvature>,
    /// Match of the depth with the ball's sphere.
    pub sphere: SphereMatch,
}

/// Features of a disc without depth, but for those of its free fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourFeatures {
    /// Likeness to the ball's colour, 0 to 1.
    pub likeness: f64,
    /// Largest difference of brightness between parts of the disc, over their mean.
    pub shading: f64,
    /// Drop of likeness at the edge, 0 to 1.
    pub contrast: f64,
    /// Part of the disc that is farther than a ball of its size.
    pub through: f64,
    /// Part of the visible rays that a nearer object covers.
    pub covered: f64,
    /// Part of the visible rays whose surroundings are behind the ball.
    pub behind: f64,
}

/// Features of a circle that is fitted to its edges alone, without the size and place known from
/// depth. A ball's circle is the one that its depth implies; that of a box, a can or a larger
/// ball is another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFitResidual {
    /// Squared error of the radius, over the usual variance.
    pub size: f64,
    /// Squared error of the centre, over the usual variance.
    pub place: f64,
    /// Root of the mean squared residual, over the usual one.
    pub rms: f64,
    /// Part of the possible edges that were found, 0 to 1.
    pub edges: f64,
}

impl DepthFeatures {
    /// Reads the features of `disc` if a ball there has its centre at depth `z`, metres. The
    /// surface is read at `readings` places from the centre to the edge; the boundary is not read
    /// yet (its parts are 0).
    pub(super) fn without_boundary(view: &FrameView, disc: &Disc, z: f64, readings: i32) -> Self {
        Self {
            attached: 0.0,
            continued: 0.0,
            covered_alike: 0.0,
            continues: 0.0,
            likeness: f64::from(Appearance::new(view, disc, Some(z)).likeness),
            curvature: curvature(view, disc, z, readings),
            sphere: match_sphere(view, disc, z),
        }
    }

    /// Adds what surrounds the disc.
    pub(super) fn with_boundary(self, boundary: &Boundary, outline: &Outline) -> Self {
        Self {
            attached: boundary.part(Surroundings::Attached),
            continued: boundary.part(Surroundings::Continued),
            covered_alike: boundary.part(Surroundings::CoveredAlike),
            continues: boundary.continues(outline),
            ..self
        }
    }
}

impl ColourFeatures {
    /// Reads the features of `disc`, a ball of whose size is at depth `z`, metres.
    pub(super) fn new(
        view: &FrameView,
        disc: &Disc,
        outline: &Outline,
        boundary: &Boundary,
        z: f64,
    ) -> Self {
        let Appearance { likeness, shading } = Appearance::new(view, disc, None);
        let inner = places().filter(|place| place.square() < THROUGH_SQUARE);
        Self {
            likeness: f64::from(likeness),
            shading: f64::from(shading),
            contrast: outline.contrast,
            through: view.part(disc, inner, |depth| depth > z),
            covered: boundary.covered(),
            behind: boundary.part(Surroundings::Behind),
        }
    }
}

impl FreeFitResidual {
    /// Fits the edges of `circle` freely, which a ball would show with `radius` pixels; `None` if
    /// there are too few edges.
    pub(super) fn new(
        view: &FrameView,
        circle: &RefinedCircle,
        radius: f64,
        boundary: &Boundary,
    ) -> Option<Self> {
        let parameters = &view.parameters.free_fit;
        let trusted = boundary.trusted();
        let free = fit_edges(view, &circle.disc, None, &trusted, false)?;
        let error = |k: usize| {
            let fit = parameters.fit_error * free.covariance[(k, k)].sqrt();
            (parameters.blur_error * free.blur).hypot(fit) / radius
        };
        let size = (free.disc.radius / radius).ln() / parameters.size_error.hypot(error(2));
        let place = parameters.place_error;
        let across = (free.disc.u - circle.disc.u) / radius / place.hypot(error(0));
        let down = (free.disc.v - circle.disc.v) / radius / place.hypot(error(1));
        let blur = parameters.rms_blur * (free.blur - parameters.sharp_blur).max(0.0);
        let usual = (parameters.rms + parameters.rms_relative * radius).hypot(blur);
        let beside = boundary.part(Surroundings::Attached) + boundary.part(Surroundings::Continued);
        let able = (1.0 - boundary.covered() - beside).max(view.parameters.decide.min_able)
            * boundary.visible();
        Some(Self {
            size: size * size,
            place: across * across + down * down,
            rms: free.rms_residual / usual,
            edges: (free.edge_count() / able).min(1.0),
        })
    }
}

/// Colour and shading on a disc.
pub(super) struct Appearance {
    /// A high quantile of the likeness to the ball's colour, 0 to 1.
    pub(super) likeness: f32,
    /// Largest difference of brightness between parts of the disc, over their mean: no sphere is
    /// lit evenly.
    pub(super) shading: f32,
}

/// Sum of the brightness in a part of a disc.
#[derive(Debug, Clone, Copy, Default)]
struct PartSum {
    sum: f32,
    count: f32,
}

impl Appearance {
    /// Reads what is visible on `disc`: without what covers a ball at depth `z`, if that is known.
    pub(super) fn new(view: &FrameView, disc: &Disc, z: Option<f64>) -> Self {
        let parameters = &view.parameters.decide;
        let mut likenesses = Vec::with_capacity(64);
        let mut parts = [PartSum::default(); SHADING_PARTS * SHADING_PARTS];
        for place in places() {
            let (u, v) = place.on(disc);
            let depth = z.zip(view.depth.at(u, v));
            let is_covered = depth.is_some_and(|(z, depth)| view.is_in_front(depth, z));
            let Some(colour) = view.colour.at(u, v).filter(|_| !is_covered) else { continue };
            likenesses.push(view.colour.ball().damped_likeness(colour, parameters.noise));
            let part = &mut parts[part_index(&place)];
            part.sum += colour.iter().sum::<f32>();
            part.count += 1.0;
        }
        likenesses.sort_by(f32::total_cmp);
        let rank = (likenesses.len() as f64 * parameters.likeness_quantile) as usize;
        let likeness = likenesses.get(rank).copied().unwrap_or(0.0);
        Self { likeness, shading: shading(&parts) }
    }
}

/// Returns the index of the part of a disc that a place is in.
fn part_index(place: &DiscPlace) -> usize {
    let index = |k: f64| ((k + 1.0) * SHADING_PARTS as f64 / 2.0) as usize;
    index(place.y) * SHADING_PARTS + index(place.x)
}

/// Returns the largest difference between the parts' means over the mean of all.
fn shading(parts: &[PartSum]) -> f32 {
    let full = parts.iter().filter(|part| part.count > MIN_PART_PLACES);
    let means = full.map(|part| part.sum / part.count);
    let (mut least, mut most, mut sum, mut n) = (f32::INFINITY, 0.0_f32, 0.0, 0.0);
    for mean in means {
        (least, most) = (least.min(mean), most.max(mean));
        (sum, n) = (sum + mean, n + 1.0);
    }
    if n > MIN_PARTS { (most - least) / (sum / n + 1.0) } else { 0.0 }
}

/// Returns the part of all rays that are within the image.
pub(super) fn part_in_image(boundary: &Boundary) -> f64 {
    boundary.visible() / RAYS as f64
}
