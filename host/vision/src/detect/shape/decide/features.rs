//! Features of a disc, which the classifier weights.

use super::super::disc_depth::places;
use super::super::ray_colours::RAYS;
use super::super::refine::{Boundary, Outline, RefinedCircle, Surroundings, fit_edges};
use super::super::view::{Disc, FrameView};
use super::curvature::{Curvature, curvature, distance_from_sphere};

/// Square of the largest distance from the centre, in the radius, at which a disc without depth is
/// checked for depth behind it.
const THROUGH_SQUARE: f64 = 0.4;

/// Features of a disc with depth, but for those of its free fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthFeatures {
    /// Part of the visible rays with an attached object of another colour.
    pub attached: f64,
    /// Part of the visible rays on which the ball's colour goes on: an object of its colour is
    /// attached or covers the edge, or neither colour nor depth shows an end.
    pub continued: f64,
    /// Likeness to the ball's colour, 0 to 1.
    pub likeness: f64,
    /// Curvature of the surface; `None` if too little of it has depth.
    pub curvature: Option<Curvature>,
    /// Median distance of the depth from the ball's sphere beyond the noise of depth, in the ball's
    /// radius.
    pub off_sphere: f64,
}

/// Features of a disc without depth, but for those of its free fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourFeatures {
    /// Part of all rays with an edge.
    pub edges: f64,
    /// Part of the disc that is farther than a ball of its size.
    pub through: f64,
    /// Likeness to the ball's colour, 0 to 1.
    pub likeness: f64,
}

/// Features of a circle that is fitted to its edges alone, without the size known from depth. A
/// ball's circle has the size that its depth implies; that of a box, a can or a larger ball has
/// another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFitResidual {
    /// Radius, pixels.
    pub radius: f64,
    /// Usual relative error of that radius: of the fit, and of blurred edges.
    pub radius_error: f64,
    /// Squared error of the radius, over the usual variance.
    pub size: f64,
    /// Root of the mean squared residual, over the usual one.
    pub rms: f64,
}

impl DepthFeatures {
    /// Reads the features of `disc` if a ball there has its centre at depth `z`, metres. The
    /// surface is read at `readings` places from the centre to the edge; the boundary is not read
    /// yet (its parts are 0).
    pub(super) fn without_boundary(view: &FrameView, disc: &Disc, z: f64, readings: i32) -> Self {
        Self {
            attached: 0.0,
            continued: 0.0,
            likeness: likeness(view, disc, z),
            curvature: curvature(view, disc, z, readings),
            off_sphere: distance_from_sphere(view, disc, z),
        }
    }

    /// Adds what surrounds the disc as far as depth shows.
    pub(super) fn with_boundary(self, boundary: &Boundary) -> Self {
        let attached = boundary.part(Surroundings::Attached);
        Self { attached, continued: boundary.continued(), ..self }
    }

    /// Adds the rays on which a refined `outline` does not end either.
    pub(super) fn with_outline(self, boundary: &Boundary, outline: &Outline) -> Self {
        Self { continued: self.continued + boundary.endless(outline), ..self }
    }
}

impl ColourFeatures {
    /// Reads the features of `circle`, a ball of whose size is at depth `z`, metres.
    pub(super) fn new(view: &FrameView, circle: &RefinedCircle, z: f64) -> Self {
        let inner = places().filter(|place| place.square() < THROUGH_SQUARE);
        Self {
            edges: circle.edge_count() / RAYS as f64,
            through: view.part(&circle.disc, inner, |depth| depth > z),
            likeness: likeness(view, &circle.disc, z),
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
        locked: bool,
    ) -> Option<Self> {
        let parameters = &view.parameters.free_fit;
        let trusted = boundary.trusted();
        let free = fit_edges(view, &circle.disc, None, &trusted, locked)?;
        let fit = parameters.fit_error * free.covariance[(2, 2)].sqrt();
        let error = (parameters.blur_error * free.blur).hypot(fit) / radius;
        let size = (free.disc.radius / radius).ln() / parameters.size_error.hypot(error);
        let blur = parameters.rms_blur * (free.blur - parameters.sharp_blur).max(0.0);
        let usual = (parameters.rms + parameters.rms_relative * radius).hypot(blur);
        let rms = free.rms_residual / usual;
        let size = size * size;
        Some(Self { radius: free.disc.radius, radius_error: error, size, rms })
    }
}

/// Returns the likeness of `disc` to the ball's colour, 0 to 1: a high quantile of what is not
/// covered, for a ball at depth `z`, metres.
fn likeness(view: &FrameView, disc: &Disc, z: f64) -> f64 {
    let parameters = &view.parameters.decide;
    let visible = places().filter_map(|place| {
        let (u, v) = place.on(disc);
        let is_covered = view.depth.at(u, v).is_some_and(|depth| view.is_in_front(depth, z));
        view.colour.at(u, v).filter(|_| !is_covered)
    });
    let ball = view.colour.ball();
    let mut likenesses: Vec<f32> =
        visible.map(|colour| ball.damped_likeness(colour, parameters.noise)).collect();
    likenesses.sort_by(f32::total_cmp);
    let rank = (likenesses.len() as f64 * parameters.likeness_quantile) as usize;
    f64::from(likenesses.get(rank).copied().unwrap_or(0.0))
}

/// Returns the part of all rays that are within the image.
pub(super) fn part_in_image(boundary: &Boundary) -> f64 {
    boundary.visible() / RAYS as f64
}
