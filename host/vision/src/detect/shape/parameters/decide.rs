//! Parameters of the stage "decide".

use super::refine::Tolerance;

/// Parameters of what surrounds a disc, ray by ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryParameters {
    /// Distance from the centre at which the depth outside the disc is read: beyond mixed pixels
    /// and beyond the usual shift of depth against colour.
    pub outside: Tolerance,
    /// Least likeness of an object of the ball's colour beside the disc, 0 to 1.
    pub same_colour: f32,
    /// Depth behind the ball's centre up to which an object is attached, in the ball's radius.
    pub attached_behind: f64,
    /// Depth in front of the centre from which on an object of another colour covers the ball, in
    /// the ball's radius.
    pub covers: f64,
    /// The same for an object of any colour.
    pub covers_any_colour: f64,
    /// Depth behind the centre from which on an object is behind the ball, in the ball's radius.
    pub behind: f64,
}

impl BoundaryParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        outside: Tolerance { relative: 1.4, pixels: 2.0 },
        same_colour: 0.25,
        attached_behind: 0.4,
        covers: 1.2,
        covers_any_colour: 2.5,
        behind: 1.0,
    };
}

/// Parameters of the curvature of a surface in depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvatureParameters {
    /// Number of pixels that share the noise of depth.
    pub noise_area: f64,
    /// Largest distance from the sphere's surface of a reading, in the ball's radius: excludes
    /// cables in front.
    pub near_surface: f64,
    /// The same more, in the median error of depth.
    pub near_noise: f64,
    /// Part of the radius within which the surface is read.
    pub surface: f64,
    /// Readings from the centre to the edge.
    pub fine_readings: i32,
    /// The same where many discs are screened.
    pub rough_readings: i32,
    /// Least number of readings.
    pub min_readings: f64,
    /// Half width of the confidence interval, standard errors.
    pub interval: f64,
    /// Median error of depth over its square, 1/m: two thirds of the standard deviation of a Kinect
    /// (K. Khoshelham, S. O. Elberink, Sensors 12, 2012: 1.4 mm at 1 m).
    pub depth_noise: f64,
    /// Least curvature of the ideal sphere at the same pixels (guards the division).
    pub min_ideal: f64,
}

impl CurvatureParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        noise_area: 10.0,
        near_surface: 0.3,
        near_noise: 4.0,
        surface: 0.85,
        fine_readings: 9,
        rough_readings: 5,
        min_readings: 14.0,
        interval: 1.5,
        depth_noise: 0.95e-3,
        min_ideal: 0.1,
    };
}

/// Thresholds of the decision, and parameters of its features.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecideParameters {
    /// Least part of the visible disc that must agree on a depth.
    pub min_depth_support: f64,
    /// Least part of the disc that counts as visible there.
    pub min_visible: f64,
    /// Grey levels of noise added to the brightness that likeness on a disc is divided by.
    pub noise: f32,
    /// Factor of the score of a ball without depth.
    pub unknown_depth_factor: f64,
    /// Least part of the rays on which the ball must end freely.
    pub min_free: f64,
    /// The same of the rays that nothing covers.
    pub min_free_of_uncovered: f64,
    /// Least log-odds by the judge of a disc without depth: an even outline alone is no ball.
    pub min_judged_without_depth: f64,
    /// Log-odds by the network below that limit from which on the mirrored patch is not judged: it
    /// would have to gain twice as much.
    pub max_mirror_gain: f64,
    /// Log-odds by the network of a disc without depth from which on the mirrored patch is not
    /// judged. With it the same balls of `rooms` (seeds 1 and 2) are found.
    pub sure_judged: f64,
    /// Least log-odds, without those by the network, before the outline fit of a disc with depth.
    /// With it as many of 1200 balls (`rooms`, ten seeds from 42 to 83) are found as with -2.
    pub min_log_odds_with_depth: f64,
    /// The same with the log-odds by the screen.
    pub min_screened_with_depth: f64,
    /// Part of the rays within the image from which on a ball is nearly whole.
    pub whole: f64,
    /// Least part of the rays within the image: a smaller sliver may belong to a larger ball. It is
    /// reached when the centre is a third of the radius outside the image.
    pub min_in_image: f64,
    /// Part of the visible rays with an edge at which a ball cut by the image's border scores 0.
    pub cut_edges_none: f64,
    /// The same from which on it keeps its score.
    pub cut_edges_full: f64,
    /// Depth in front of the ball's centre from which on an object covers the disc, in the ball's
    /// radius.
    pub covers_disc: f64,
    /// Quantile of the likenesses on the disc that is the disc's likeness.
    pub likeness_quantile: f64,
}

impl DecideParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        min_depth_support: 0.33,
        min_visible: 0.3,
        noise: 12.0,
        unknown_depth_factor: 0.9,
        min_free: 0.25,
        min_free_of_uncovered: 0.4,
        min_judged_without_depth: -2.0,
        max_mirror_gain: 1.5,
        sure_judged: 4.0,
        min_log_odds_with_depth: -0.4,
        min_screened_with_depth: -0.5,
        whole: 0.8,
        min_in_image: 0.36,
        cut_edges_none: 0.4,
        cut_edges_full: 0.75,
        covers_disc: 1.5,
        likeness_quantile: 0.65,
    };
}

/// Parameters of the free fit: the usual errors of a ball's outline that is fitted to its edges
/// alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFitParameters {
    /// Standard deviation of the radius's logarithm against the radius that depth gives.
    pub size_error: f64,
    /// Further standard deviation, in the edges' blur.
    pub blur_error: f64,
    /// Further standard deviation, in that of the fit.
    pub fit_error: f64,
    /// Usual rms residual of the edges, pixels.
    pub rms: f64,
    /// The same, in the radius.
    pub rms_relative: f64,
    /// The same, in the blur beyond that of a sharp image.
    pub rms_blur: f64,
    /// Blur of a sharp image, pixels.
    pub sharp_blur: f64,
}

impl FreeFitParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        size_error: 0.025,
        blur_error: 0.3,
        fit_error: 2.0,
        rms: 0.2,
        rms_relative: 0.012,
        rms_blur: 0.9,
        sharp_blur: 0.5,
    };
}
