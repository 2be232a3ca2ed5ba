//! Parameters of the detector `ball`, stage by stage.
//!
//! Lengths are in pixels of the full image, in metres, or in units of the ball's radius (in the
//! image or in space), as each field says. Where no source is given, the value was chosen on
//! `plumb-lab vision` (suites `scenes` and `hard`).

mod decide;
mod propose;
mod refine;
mod weights;

pub use decide::{BoundaryParameters, CurvatureParameters, DecideParameters, FreeFitParameters};
pub use propose::{ClusterParameters, ProposeParameters, SphereFitParameters};
pub use refine::{EdgeBand, EdgeParameters, ProfileParameters, RefineParameters, Tolerance};
pub use weights::{ColourWeights, DepthWeights, Hinge, Weights};

/// Parameters of the detector `ball`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeParameters {
    /// Search over the candidates of a frame.
    pub search: SearchParameters,
    /// Propose: places by the network.
    pub propose: ProposeParameters,
    /// Propose: clusters of coloured pixels with depth.
    pub clusters: ClusterParameters,
    /// Propose: fit of a sphere to depth.
    pub sphere: SphereFitParameters,
    /// Refine: radial profile of colour.
    pub profile: ProfileParameters,
    /// Refine: sub-pixel edges.
    pub edges: EdgeParameters,
    /// Refine: when a fit is repeated or rejected.
    pub refine: RefineParameters,
    /// Decide: what surrounds the disc.
    pub boundary: BoundaryParameters,
    /// Decide: curvature of the surface.
    pub curvature: CurvatureParameters,
    /// Decide: thresholds and features.
    pub decide: DecideParameters,
    /// Decide: fit to the edges alone.
    pub free_fit: FreeFitParameters,
    /// Decide: weights of the classifier.
    pub weights: Weights,
}

impl ShapeParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        search: SearchParameters::DEFAULT,
        propose: ProposeParameters::DEFAULT,
        clusters: ClusterParameters::DEFAULT,
        sphere: SphereFitParameters::DEFAULT,
        profile: ProfileParameters::DEFAULT,
        edges: EdgeParameters::DEFAULT,
        refine: RefineParameters::DEFAULT,
        boundary: BoundaryParameters::DEFAULT,
        curvature: CurvatureParameters::DEFAULT,
        decide: DecideParameters::DEFAULT,
        free_fit: FreeFitParameters::DEFAULT,
        weights: Weights::DEFAULT,
    };
}

impl Default for ShapeParameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Parameters of the search over a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchParameters {
    /// Least distance of the ball, metres along the optical axis.
    pub min_distance: f64,
    /// Largest distance of the ball, metres along the optical axis.
    pub max_distance: f64,
    /// Part by which a refined radius may lie outside the radii of those distances.
    pub radius_margin: f64,
    /// Least score of a ball, 0 to 1.
    pub min_score: f64,
    /// Least score in the window around the previous ball; below it the whole image is searched.
    pub min_score_tracked: f64,
    /// Score that ends the search, because no other candidate can be much better.
    pub certain_score: f64,
    /// Half size of the window around the previous ball: in its radius, and pixels more.
    pub window: Tolerance,
    /// Largest number of spheres in depth that are refined.
    pub max_spheres: usize,
    /// Largest number of the network's proposals that are refined: the budget of a search.
    pub max_refined: usize,
    /// Log-odds by which a proposal may be less promising than one that is a ball and still be
    /// refined.
    pub rival_log_odds: f64,
    /// Least log-odds by the judge of a circle without depth that is fitted once more, where the
    /// judge sees the ball, and of one that is fitted a third and a fourth time. In front of a
    /// small poster of the ball's colour each fit may bring the judge nearer.
    pub min_judged_beside: [f64; 3],
    /// Least distance of that place from the circle, in the circle's radius: the distance of the
    /// centres and the difference of the radii. A rejected circle is fitted once more wherever the
    /// network sees the ball.
    pub min_beside: f64,
    /// Candidates whose centres are nearer than this are one, in the smaller radius.
    pub same_centre: f64,
    /// Candidates whose radii differ by less than this are one, in the smaller radius.
    pub same_radius: f64,
}

impl SearchParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        min_distance: 0.25,
        max_distance: 3.2,
        radius_margin: 0.07,
        min_score: 0.52,
        min_score_tracked: 0.75,
        certain_score: 0.95,
        window: Tolerance { relative: 3.0, pixels: 16.0 },
        max_spheres: 4,
        max_refined: 5,
        rival_log_odds: 1.0,
        min_judged_beside: [0.0, 1.5, 1.5],
        min_beside: 0.1,
        same_centre: 0.12,
        same_radius: 0.1,
    };
}
