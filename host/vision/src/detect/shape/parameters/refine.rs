//! Parameters of the stage "refine".

/// A length that grows with the disc: a part of its radius and some pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// In the disc's radius.
    pub relative: f64,
    /// Pixels more.
    pub pixels: f64,
}

impl Tolerance {
    /// Returns the length for a disc of `radius` pixels.
    pub fn at(&self, radius: f64) -> f64 {
        self.relative * radius + self.pixels
    }
}

/// Parameters of the radial profile of likeness around a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileParameters {
    /// Least drop of likeness at an edge, in the contrast of a clear edge.
    pub clear_drop: f32,
    /// Least likeness beyond the disc for the ball's colour to continue, in the contrast.
    pub continued_likeness: f32,
}

impl ProfileParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self { clear_drop: 0.4, continued_likeness: 0.5 };
}

/// The band around a disc in which its edges are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeBand {
    /// Half width, in the disc's radius.
    pub relative: f64,
    /// Least half width, pixels.
    pub min_pixels: f64,
}

/// Parameters of the sub-pixel edges and of the circle through them.
///
/// `limb_error`, `foreign_edges_error`, `even_edges` and `background_edges_error` come from the
/// errors of 261 circles without depth (`plumb-lab vision --suite rooms`, seeds 1 and 2) and from
/// the balls behind posts of `tests/tests/it/monocular.rs`: the mean of e' C⁻¹ e is between 2
/// and 4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeParameters {
    /// Band of each pass.
    pub bands: [EdgeBand; 4],
    /// Largest half width of the band if the start is locked, in the disc's radius.
    pub locked_band: f64,
    /// Half width of the band once the blur is known: in its standard deviation. Nearer to the
    /// edge both colours are mixed; farther away they are other colours.
    pub blur_band: f64,
    /// Pixels more.
    pub blur_band_pixels: f64,
    /// Correction of an edge that is wider than the opposite one, in the difference of their blurs.
    pub glare_gain: f64,
    /// Largest difference of blurs that is corrected, pixels.
    pub max_glare: f64,
    /// Cut-off of Tukey's biweight, in the band's half width.
    pub cutoff: f64,
    /// Standard deviation of a radius known from depth.
    pub radius_error: Tolerance,
    /// Least standard deviation of one edge, pixels.
    pub edge_error: f64,
    /// Weight of the previous disc, in clear edges, in directions without edges.
    pub damping: f64,
    /// Standard deviation of the error that all edges share, pixels: reflections along the limb.
    pub systematic_error: f64,
    /// Standard deviation of the blur of a sharp image, pixels.
    pub sharp_blur: f64,
    /// Error that all edges share, in the blur beyond that of a sharp image.
    pub blur_error: f64,
    /// Further error of the centre, in the product of that blur and the rms residual (both pixels):
    /// over a background of many colours, the edges of a moving ball err together on one side.
    pub motion_error: f64,
    /// Further error of the radius, in that blur: out of focus, the dark limb of a shaded ball
    /// passes for the background and makes the circle smaller.
    pub limb_error: f64,
    /// Further error of the radius, in the rms residual: where an object covers part of the ball,
    /// its edges pass for the ball's and make the circle smaller.
    pub foreign_edges_error: f64,
    /// Rms residual of the edges of a ball in front of another colour, pixels.
    pub even_edges: f64,
    /// Further error of the centre, in the rms residual beyond `even_edges`: in front of the ball's
    /// own colour, some of the edges are the background's, on one side more than on the other.
    pub background_edges_error: f64,
    /// Difference of colours that has half the full weight, grey levels.
    pub faint_contrast: f32,
    /// Distance from the disc within which an edge belongs to the disc.
    pub touching: Tolerance,
    /// Weight from which on an edge is clear.
    pub clear_weight: f64,
    /// Least sum of the weights of a fit, rays.
    pub min_weight: f64,
}

impl EdgeParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        bands: [
            EdgeBand { relative: 0.5, min_pixels: 4.0 },
            EdgeBand { relative: 0.4, min_pixels: 3.5 },
            EdgeBand { relative: 0.35, min_pixels: 1.8 },
            EdgeBand { relative: 0.35, min_pixels: 1.2 },
        ],
        locked_band: 0.25,
        blur_band: 1.3,
        blur_band_pixels: 0.35,
        glare_gain: 1.3,
        max_glare: 0.6,
        cutoff: 0.8,
        radius_error: Tolerance { relative: 0.005, pixels: 0.1 },
        edge_error: 0.4,
        damping: 0.05,
        systematic_error: 0.09,
        sharp_blur: 0.5,
        blur_error: 0.45,
        motion_error: 3.5,
        limb_error: 2.0,
        foreign_edges_error: 0.46,
        even_edges: 0.2,
        background_edges_error: 1.5,
        faint_contrast: 12.0,
        touching: Tolerance { relative: 0.05, pixels: 0.3 },
        clear_weight: 0.3,
        min_weight: 4.0,
    };
}

/// Parameters that say when a refinement is repeated or rejected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefineParameters {
    /// Largest move of a locked disc.
    pub locked_move: Tolerance,
    /// Move after which the disc is refined again, in its radius.
    pub repeat_move: f64,
    /// Difference from the radius that depth gives after which the disc is refined again, in the
    /// radius.
    pub repeat_resize: f64,
    /// Standard deviation of a disc with too few edges to refine, in its radius.
    pub unrefined_error: f64,
}

impl RefineParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        locked_move: Tolerance { relative: 0.12, pixels: 4.0 },
        repeat_move: 0.1,
        repeat_resize: 0.025,
        unrefined_error: 0.15,
    };
}
