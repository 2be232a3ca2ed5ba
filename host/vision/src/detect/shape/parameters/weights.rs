//! Weights of the classifier.

/// A penalty for less of something than enough: `weight * max(enough - x, 0)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Value without a penalty.
    pub enough: f64,
    /// Log-odds lost for each unit less.
    pub weight: f64,
}

impl Hinge {
    /// Returns the penalty of `x`.
    pub fn penalty(&self, x: f64) -> f64 {
        self.weight * (self.enough - x).max(0.0)
    }
}

/// Weights of the classifier, in log-odds for each unit of a feature.
///
/// They come from the candidates of `plumb bench vision`: `scripts/detector` has the commands.
/// Those with depth come from a logistic regression on 1108 discs (`rooms`, seeds 2, 3 and 5;
/// `hard`, seeds 61 and 62) that the networks before the last training judged, rounded; its
/// intercept was then raised by 0.15. Those without depth come from a grid over 2112 pictures with
/// a ball and 2640 without one (`rooms`, eleven seeds from 51 to 64), but for `through`, which an
/// earlier regression gave, and `likeness`. The results on other seeds and pictures are in the
/// chapter on the detector (docs/understand/detector.md).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// For discs with depth.
    pub depth: DepthWeights,
    /// For discs without depth.
    pub colour: ColourWeights,
    /// For the free fit.
    pub free_fit: FreeFitWeights,
}

impl Weights {
    /// The default weights.
    pub const DEFAULT: Self = Self {
        depth: DepthWeights::DEFAULT,
        colour: ColourWeights::DEFAULT,
        free_fit: FreeFitWeights::DEFAULT,
    };
}

/// Weights of [`DepthFeatures`](crate::detect::shape::DepthFeatures).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthWeights {
    /// Log-odds of a disc without any penalty.
    pub intercept: f64,
    /// For the part of the rays with an attached object of another colour.
    pub attached: f64,
    /// For the part of the rays with an attached object of the ball's colour.
    pub continued: f64,
    /// For the part of the rays covered by an object of the ball's colour.
    pub covered_alike: f64,
    /// For the part of the rays on which the ball's colour continues without an end.
    pub continues: f64,
    /// For the log-odds by the network.
    pub judged: f64,
    /// Least log-odds by the network that count: a sphere of the ball's size that stands free is
    /// the ball, whatever the network says. Not from the regression: with it, no other disc of
    /// `rooms` (seeds 1 and 2) is taken for the ball.
    pub min_judged: f64,
    /// Largest log-odds by the network that count.
    pub max_judged: f64,
    /// For little likeness.
    pub likeness: Hinge,
    /// For the upper bound of the curvature.
    pub flat: Hinge,
    /// Largest shortfall of curvature that counts.
    pub max_flat: f64,
    /// For the part of the disc on the ball's sphere.
    pub on_sphere: Hinge,
    /// For the median distance from that sphere, in the ball's radius.
    pub off_sphere: f64,
    /// Largest such distance that counts.
    pub max_off_sphere: f64,
    /// Largest roundness that counts.
    pub max_round: f64,
    /// Least lower bound of the curvature of a sphere beyond doubt.
    pub sphere_round: f64,
    /// Least part of the disc on it.
    pub sphere_on: f64,
    /// Largest median distance from it, in the ball's radius.
    pub sphere_off: f64,
}

impl DepthWeights {
    /// The default weights.
    pub const DEFAULT: Self = Self {
        intercept: 4.0,
        attached: 5.0,
        continued: 3.5,
        covered_alike: 0.7,
        continues: 1.0,
        judged: 0.55,
        min_judged: -4.0,
        max_judged: 8.0,
        likeness: Hinge { enough: 0.55, weight: 22.1 },
        flat: Hinge { enough: 0.8, weight: 8.8 },
        max_flat: 0.5,
        on_sphere: Hinge { enough: 0.6, weight: 1.1 },
        off_sphere: 17.0,
        max_off_sphere: 0.2,
        max_round: 0.8,
        sphere_round: 0.8,
        sphere_on: 0.85,
        sphere_off: 0.04,
    };
}

/// Weights of [`ColourFeatures`](crate::detect::shape::ColourFeatures).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourWeights {
    /// Log-odds of a disc that the network is undecided about, without any penalty.
    pub intercept: f64,
    /// For the log-odds by the network.
    pub judged: f64,
    /// Largest log-odds by the network that count.
    pub max_judged: f64,
    /// For the part of all rays without an edge.
    pub missing: f64,
    /// For the part of the disc that is farther than a ball of its size.
    pub through: f64,
    /// For little likeness: a dark round hole is no ball. Of 362 balls that are found (`rooms`,
    /// seeds 21 and 22) 7 have less than 0.5.
    pub likeness: Hinge,
    /// For the rms residual of the free fit.
    pub rms: f64,
    /// Largest rms residual that counts.
    pub max_rms: f64,
}

impl ColourWeights {
    /// The default weights.
    pub const DEFAULT: Self = Self {
        intercept: 2.4,
        judged: 0.4,
        max_judged: 8.0,
        missing: 5.5,
        through: 16.9,
        likeness: Hinge { enough: 0.5, weight: 4.0 },
        rms: 1.6,
        max_rms: 3.5,
    };
}

/// Weights of [`FreeFitResidual`](crate::detect::shape::FreeFitResidual).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFitWeights {
    /// With depth: for the squared error of size.
    pub size: f64,
    /// With depth: for the squared error of place.
    pub place: f64,
    /// Largest squared error that counts: beyond it the disc is another object, whichever.
    pub max_square: f64,
    /// With depth: for the square of the rms residual beyond `rms_free`.
    pub rms: f64,
    /// With depth: for the rms residual beyond `rms_free`.
    pub uneven: f64,
    /// Reduction of the weight `rms` for each unit of roundness.
    pub rms_round: f64,
    /// Rms residual without a penalty, in the usual one.
    pub rms_free: f64,
    /// Largest square of the rms residual that counts.
    pub max_rms_square: f64,
    /// Part of the whole penalty that is dropped where depth shows a sphere that ends all around.
    /// Not from the regression: a ball in front of a surface of its colour has the edges of that
    /// surface's pattern.
    pub sphere_discount: f64,
}

impl FreeFitWeights {
    /// The default weights.
    pub const DEFAULT: Self = Self {
        size: 0.15,
        place: 0.0075,
        max_square: 40.0,
        rms: 1.03,
        uneven: 1.9,
        rms_round: 0.84,
        rms_free: 0.7,
        max_rms_square: 4.0,
        sphere_discount: 0.8,
    };
}
