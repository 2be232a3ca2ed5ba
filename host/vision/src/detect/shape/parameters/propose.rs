//! Parameters of the stage "propose".

use super::refine::Tolerance;

/// Parameters of the places that the network proposes.
///
/// `min_log_odds_without_depth` and `min_log_odds_with_depth` come from `rooms` (seeds 88 to 90 and
/// 1151 to 1154), photographs (105 and 106) and `hard` (1161), 1743 balls without depth and 2385
/// with it. Without depth -2.25 finds as many as -2.5, and judges 37 % fewer places in the pictures
/// without a ball (seeds 88 to 90); -2 loses four. With depth most balls are found as spheres
/// before: -1.75 finds 2379 where -2.5 finds 2381, and a search without a ball takes about a fifth
/// less time.
///
/// Of patches of the bench (`scripts/detector`, seeds 1032 and 1034) `min_judged` leaves out none
/// of 1869 balls, 83 % of the others with depth and 36 % of those without; `min_judged_again` none,
/// 95 % and 77 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProposeParameters {
    /// Least log-odds of a proposal in a frame with depth.
    pub min_log_odds_with_depth: f32,
    /// Least log-odds of a proposal in a frame without depth.
    pub min_log_odds_without_depth: f32,
    /// Largest radius of a ball, pixels, that the network proposes at a quarter of the size. Larger
    /// balls are looked for at an eighth of the size, and so on.
    pub max_radius: f64,
    /// Largest number of proposals that are judged: the budget of a search. A busy picture has more
    /// red places than a room of `plumb-lab vision`: docs/understand/detector.md has the figures.
    pub max_judged: usize,
    /// Least log-odds by the screen of a proposal that is judged once more, where it saw the ball.
    pub min_judged: f64,
    /// Least log-odds by the screen the second time of a proposal that is refined.
    pub min_judged_again: f64,
    /// Log-odds by the screen from which on a proposal is likely the ball.
    pub likely: f64,
    /// Log-odds by the proposer by which a proposal may be less promising than the first
    /// one and still be judged if a likely one was found. The rest is judged if that is not the
    /// ball.
    pub rival_log_odds: f64,
    /// Distance of the nine pixels that the depth of a proposal is read at, in its radius.
    pub depth_spacing: f64,
    /// Least number of those pixels with depth.
    pub min_depths: usize,
}

impl ProposeParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        min_log_odds_with_depth: -1.75,
        min_log_odds_without_depth: -2.25,
        max_radius: 72.0,
        max_judged: 16,
        min_judged: -6.0,
        min_judged_again: -3.5,
        likely: 1.5,
        rival_log_odds: 1.5,
        depth_spacing: 0.4,
        min_depths: 4,
    };
}

/// Parameters of the clusters of coloured pixels with depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterParameters {
    /// Least likeness of a coloured pixel, 0 to 1.
    pub min_likeness: f32,
    /// Least likeness of a neighbour on the same object, in the pixel's likeness.
    pub same_object: f32,
    /// Distance at which a ball must have ended.
    pub beyond: Tolerance,
    /// Least number of the eight directions in which it must have ended.
    pub min_ends: usize,
    /// Distance at which the object must still be there, in the ball's radius.
    pub within: f64,
    /// Least number of the four directions in which it must still be there.
    pub min_within: usize,
    /// Radius from which on only every second cell of every second row is read, pixels.
    ///
    /// The cells that are read are 8 pixels apart, so one of them is at most 5.7 pixels from the
    /// ball's centre. Up to half a radius and 2 pixels from the centre (6 pixels for this radius) a
    /// cell belongs to the cluster. With 8 as with 14, 2381 of 2385 balls with depth are found
    /// (`rooms`, seeds 88 to 90 and 1151 to 1154; with photographs 105 and 106; `hard`, seed 1161).
    pub large_radius: f64,
    /// Largest number of clusters that a sphere is fitted to.
    pub max_clusters: usize,
}

impl ClusterParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        min_likeness: 0.14,
        same_object: 0.4,
        beyond: Tolerance { relative: 1.5, pixels: 2.0 },
        min_ends: 6,
        within: 0.45,
        min_within: 2,
        large_radius: 8.0,
        max_clusters: 10,
    };
}

/// Parameters of the fit of a sphere of the ball's radius to depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereFitParameters {
    /// Number of depth pixels that are read along the sphere's diameter.
    pub grid: f64,
    /// Radius within which depth is read, in the ball's radius in the image.
    pub reach: f64,
    /// Largest distance in depth from the centre of a pixel that is read, in the ball's radius.
    pub depth_reach: f64,
    /// Distance of the first centre behind the surface, in the ball's radius.
    pub first_depth: f64,
    /// Cut-off of Tukey's biweight in each step, in the ball's radius.
    pub cutoffs: [f64; 5],
    /// Step in which the pixels are read again around the new centre.
    pub reread_step: usize,
    /// Largest move of the centre in a step, in the ball's radius.
    pub max_move: f64,
    /// Least number of pixels on the sphere.
    pub min_pixels: usize,
    /// Number of directions in which the end of the sphere is checked.
    pub end_directions: u32,
    /// Depth in front of the centre from which on a neighbour is another object, in the ball's
    /// radius.
    pub in_front: f64,
    /// Least quality (part of the disc on the sphere times part of the directions in which it
    /// ends), 0 to 1. Of 960 balls (`rooms`, seeds 51 to 54) it loses none, 0.35 loses one, and 0.4
    /// three.
    pub min_quality: f64,
}

impl SphereFitParameters {
    /// The default parameters.
    pub const DEFAULT: Self = Self {
        grid: 10.0,
        reach: 1.15,
        depth_reach: 1.6,
        first_depth: 0.8,
        cutoffs: [1.0, 0.7, 0.5, 0.35, 0.3],
        reread_step: 2,
        max_move: 0.7,
        min_pixels: 6,
        end_directions: 16,
        in_front: 2.5,
        min_quality: 0.3,
    };
}
