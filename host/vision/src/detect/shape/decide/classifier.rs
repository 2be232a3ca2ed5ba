//! The classifier: from features to the probability that a disc is the ball.
//!
//! Each feature has its weight, and the sum is the logarithm of the odds: a small excess of one
//! feature may be balanced by the others, which a limit for each feature could not do. The weights
//! and where they come from are in [`Weights`].

use super::super::parameters::Weights;
use super::features::{ColourFeatures, DepthFeatures, FreeFitResidual};

/// A logistic classifier.
pub(super) struct Classifier<'a> {
    weights: &'a Weights,
}

impl<'a> Classifier<'a> {
    /// Makes the classifier with `weights`.
    pub(super) fn new(weights: &'a Weights) -> Self {
        Self { weights }
    }

    /// Returns the log-odds of a disc with depth if its free fit has no penalty: an upper bound.
    pub(super) fn depth_log_odds(&self, features: &DepthFeatures) -> f64 {
        let weights = &self.weights.depth;
        let flat = features.curvature.map_or(0.0, |curvature| {
            weights.flat.penalty(curvature.most).min(weights.flat.weight * weights.max_flat)
        });
        weights.intercept
            - weights.attached * features.attached
            - weights.continued * features.continued
            - weights.likeness.penalty(features.likeness)
            - flat
            - weights.off_sphere * features.off_sphere.min(weights.max_off_sphere)
    }

    /// Returns the term of a network's log-odds `judged` in those of a disc with depth.
    pub(super) fn judged_log_odds(&self, judged: f64) -> f64 {
        let weights = &self.weights.depth;
        weights.judged * judged.clamp(weights.min_judged, weights.max_judged)
    }

    /// Returns the least that a network adds to the log-odds of a disc with depth.
    pub(super) fn least_judged(&self) -> f64 {
        self.judged_log_odds(f64::NEG_INFINITY)
    }

    /// Returns the most that a network adds to the log-odds of a disc with depth.
    pub(super) fn most_judged(&self) -> f64 {
        self.judged_log_odds(f64::INFINITY)
    }

    /// Returns the log-odds of a disc without depth that the network gives `judged`, if its free
    /// fit has no penalty: an upper bound.
    pub(super) fn colour_log_odds(&self, features: &ColourFeatures, judged: f64) -> f64 {
        let weights = &self.weights.colour;
        weights.intercept + weights.judged * judged.min(weights.max_judged)
            - weights.missing * (1.0 - features.edges)
            - weights.through * features.through
            - weights.likeness.penalty(features.likeness)
    }

    /// Returns the penalty of the free fit of a disc with depth.
    pub(super) fn depth_penalty(&self, free: &FreeFitResidual, features: &DepthFeatures) -> f64 {
        let weights = &self.weights.depth;
        let round = features.curvature.map_or(0.0, |curvature| curvature.least.clamp(0.0, 1.0));
        weights.size * free.size.min(weights.max_size)
            + (weights.rms - weights.rms_round * round) * free.rms.min(weights.max_rms)
    }

    /// Returns the penalty of the free fit of a disc without depth.
    pub(super) fn colour_penalty(&self, free: &FreeFitResidual) -> f64 {
        let weights = &self.weights.colour;
        weights.rms * free.rms.min(weights.max_rms)
    }
}

/// Returns the probability, 0 to 1, of these log-odds.
pub(crate) fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}
