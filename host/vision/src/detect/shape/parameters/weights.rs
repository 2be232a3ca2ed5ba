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
/// They come from the candidates of `plumb-lab vision`: `scripts/detector` has the commands.
/// Those with depth come from a logistic regression of the best candidates of 12240 pictures
/// (`rooms`, 18 seeds from 41 to 84; `hard`, seeds 61 to 64), rounded, but for the intercept. Those
/// without depth come from a grid over 2112 pictures with a ball and 2640 without one (`rooms`,
/// eleven seeds from 51 to 64), but for `through`, which an earlier regression gave, and
/// `likeness`. The results on other seeds and pictures are in the chapter on the detector
/// (docs/understand/detector.md).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// For discs with depth.
    pub depth: DepthWeights,
    /// For discs without depth.
    pub colour: ColourWeights,
}

impl Weights {
    /// The default weights.
    pub const DEFAULT: Self = Self { depth: DepthWeights::DEFAULT, colour: ColourWeights::DEFAULT };
}

/// Weights of [`DepthFeatures`](crate::detect::shape::DepthFeatures), and of
/// [`FreeFitResidual`](crate::detect::shape::FreeFitResidual) of a disc with depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthWeights {
    /// Log-odds of a disc that the network is undecided about, without any penalty. With 3.0 none
    /// of 1665 balls with depth is lost (`rooms`, seeds 88, 89 and 1151 to 1154; `hard`, seed
    /// 1161), with 2.6 two are.
    pub intercept: f64,
    /// For the log-odds by the network.
    pub judged: f64,
    /// Least log-odds by the network that count: a sphere of the ball's size that stands free may
    /// be the ball, whatever the network says.
    pub min_judged: f64,
    /// Largest log-odds by the network that count.
    pub max_judged: f64,
    /// For the part of the rays with an attached object of another colour.
    pub attached: f64,
    /// For the part of the rays on which the ball's colour goes on.
    pub continued: f64,
    /// For little likeness.
    pub likeness: Hinge,
    /// For the upper bound of the curvature.
    pub flat: Hinge,
    /// Largest shortfall of curvature that counts.
    pub max_flat: f64,
    /// For the distance of the depth from the ball's sphere, in the ball's radius.
    pub off_sphere: f64,
    /// Largest such distance that counts.
    pub max_off_sphere: f64,
    /// For the squared error of size of the free fit.
    pub size: f64,
    /// Largest squared error that counts: beyond it the disc is another object, whichever.
    pub max_size: f64,
    /// For the rms residual of the free fit.
    pub rms: f64,
    /// Reduction of `rms` for each unit of the lower bound of the curvature: a ball in front of a
    /// surface of its colour has the edges of that surface's pattern.
    pub rms_round: f64,
    /// Largest rms residual that counts.
    pub max_rms: f64,
}

impl DepthWeights {
    /// The default weights.
    pub const DEFAULT: Self = Self {
        intercept: 3.0,
        judged: 0.45,
        min_judged: -4.0,
        max_judged: 8.0,
        attached: 9.2,
        continued: 11.7,
        likeness: Hinge { enough: 0.55, weight: 21.7 },
        flat: Hinge { enough: 0.8, weight: 14.1 },
        max_flat: 0.5,
        off_sphere: 16.4,
        max_off_sphere: 0.2,
        size: 0.129,
        max_size: 40.0,
        rms: 2.32,
        rms_round: 1.84,
        max_rms: 2.0,
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
    /// For little likeness: a dark round hole or a castor is no ball. With a weight of 8 instead of
    /// 4, 5 instead of 11 of 2240 pictures without a ball (`rooms`, seeds 51, 52 and 55 to 58) have
    /// a false alarm, and as many balls are found, 2534 of 2592.
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
        likeness: Hinge { enough: 0.5, weight: 8.0 },
        rms: 1.6,
        max_rms: 3.5,
    };
}
