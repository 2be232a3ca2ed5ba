//! Stage 4, decide: how likely a refined circle is the ball.
//!
//! [`features`] reads how much of the disc is visible, its colour, its surface and its
//! surroundings, and fits its edges once more without the depth. [`classifier`] weights them.
//! Screens that are cheaper than a refinement use the same features.

mod classifier;
mod curvature;
mod features;

use super::parameters::DecideParameters;
use super::ray_colours::RAYS;
use super::refine::{Boundary, Candidate, Outline, Surroundings};
use super::view::{Disc, FrameView};
use classifier::Classifier;
use features::part_in_image;

pub(super) use super::disc_depth::screen;
pub(crate) use classifier::probability;
pub use curvature::Curvature;
pub use features::{ColourFeatures, DepthFeatures, FreeFitResidual};

/// Features of a candidate, for the classifier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Features {
    /// Of a disc with depth.
    Depth(DepthFeatures),
    /// Of a disc without depth.
    Colour(ColourFeatures),
}

/// A decision about a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Probability that the candidate is the ball, 0 to 1. It is 0 if the candidate was rejected
    /// early: before all features were read, or for want of edges.
    pub score: f64,
    /// Log-odds by the judge. Without depth it is the mean of those of the picture
    /// and of its mirror image, if the first of them are not clear. `None` if the candidate was
    /// rejected without the network.
    pub judged: Option<f64>,
    /// Without depth: where the judge sees the ball.
    pub seen: Option<Disc>,
    /// What surrounds the disc, ray by ray; `None` outside the image.
    pub surroundings: [Option<Surroundings>; RAYS],
    /// Features, as far as they were read.
    pub features: Option<Features>,
    /// Residual of the free fit, if it was made.
    pub free_fit: Option<FreeFitResidual>,
}

/// Decides about the candidates of a frame.
pub(super) struct Decider<'a> {
    view: &'a FrameView<'a>,
    parameters: &'a DecideParameters,
    classifier: Classifier<'a>,
}

impl<'a> Decider<'a> {
    /// Decides in `view`.
    pub(super) fn new(view: &'a FrameView<'a>) -> Self {
        let classifier = Classifier::new(&view.parameters.weights);
        Self { view, parameters: &view.parameters.decide, classifier }
    }

    /// Checks whether the log-odds of `disc`, where depth shows a sphere, are high enough for a
    /// refinement: without the edges, and at last with the log-odds by the screen.
    pub(super) fn passes(&self, disc: &Disc) -> bool {
        let view = self.view;
        let Some(z) = view.centre_depth(disc) else { return false };
        let least = self.parameters.min_log_odds_with_depth;
        let readings = view.parameters.curvature.rough_readings;
        let features = DepthFeatures::without_boundary(view, disc, z, readings);
        if self.classifier.depth_log_odds(&features) <= least {
            return false;
        }
        let outline = Outline::new(view, *disc);
        let boundary = Boundary::new(view, &outline, z);
        // The outline is not refined yet, so rays on which the colour has no end say little.
        let log_odds = self.classifier.depth_log_odds(&features.with_boundary(&boundary));
        let least_judged = self.parameters.min_screened_with_depth;
        // The network is asked only if it could reject the disc.
        let is_certain = log_odds + self.classifier.least_judged() > least_judged;
        let judged = || self.classifier.judged_log_odds(screen(view, disc).log_odds);
        log_odds > least && (is_certain || log_odds + judged() > least_judged)
    }

    /// Decides about `candidate`. A candidate whose score will be less than `least` is rejected as
    /// soon as this is known.
    pub(super) fn decide(&self, candidate: &Candidate, least: f64) -> Decision {
        let Candidate { circle, depth, outline, .. } = candidate;
        let by_image = self.view.depth_of(&circle.disc);
        let boundary = Boundary::new(self.view, outline, depth.unwrap_or(by_image));
        let surroundings = *boundary.rays();
        let mut decision = Decision {
            score: 0.0,
            judged: None,
            seen: None,
            surroundings,
            features: None,
            free_fit: None,
        };
        let free = boundary.part(Surroundings::Free) + boundary.part(Surroundings::Behind);
        let uncovered = (1.0 - boundary.covered()).max(0.01);
        if free > self.parameters.min_free
            && free / uncovered > self.parameters.min_free_of_uncovered
        {
            match *depth {
                Some(z) => self.with_depth(candidate, &boundary, z, least, &mut decision),
                None => {
                    let factor = self.parameters.unknown_depth_factor;
                    let least = least / factor;
                    self.without_depth(candidate, &boundary, by_image, least, &mut decision);
                    decision.score *= factor;
                }
            }
        }
        decision
    }

    /// Scores a candidate with depth `z`.
    fn with_depth(
        &self,
        Candidate { circle, outline, .. }: &Candidate,
        boundary: &Boundary,
        z: f64,
        least: f64,
        decision: &mut Decision,
    ) {
        let in_image = part_in_image(boundary);
        let edges = circle.edge_count() / boundary.visible();
        // At the border less of a larger ball's cap fits, and a sliver may be a smaller ball's.
        let &DecideParameters { cut_edges_none, cut_edges_full, .. } = self.parameters;
        let is_whole = in_image > self.parameters.whole;
        let cut = if is_whole { 1.0 } else { ramp(edges, cut_edges_none, cut_edges_full) };
        if cut == 0.0 || in_image < self.parameters.min_in_image {
            return;
        }
        let readings = self.view.parameters.curvature.fine_readings;
        let features = DepthFeatures::without_boundary(self.view, &circle.disc, z, readings)
            .with_boundary(boundary)
            .with_outline(boundary, outline);
        decision.features = Some(Features::Depth(features));
        let log_odds = self.classifier.depth_log_odds(&features);
        if cut * probability(log_odds + self.classifier.most_judged()) < least {
            return;
        }
        let judged = super::disc_depth::log_odds(self.view, &circle.disc);
        decision.judged = Some(judged);
        let log_odds = log_odds + self.classifier.judged_log_odds(judged);
        if cut * probability(log_odds) < least {
            return;
        }
        let radius = self.view.radius_at(z);
        decision.free_fit = FreeFitResidual::new(self.view, circle, radius, boundary, false);
        decision.score = decision.free_fit.map_or(0.0, |free| {
            cut * probability(log_odds - self.classifier.depth_penalty(&free, &features))
        });
    }

    /// Scores a candidate without depth; a ball of its size is at depth `z`.
    fn without_depth(
        &self,
        Candidate { circle, locked, .. }: &Candidate,
        boundary: &Boundary,
        z: f64,
        least: f64,
        decision: &mut Decision,
    ) {
        let min_judged = self.parameters.min_judged_without_depth;
        let hopeless = min_judged - self.parameters.max_mirror_gain;
        let unsure = hopeless..self.parameters.sure_judged;
        let judgement = super::disc_depth::judge_mirrored(self.view, &circle.disc, unsure);
        let judged = judgement.log_odds;
        let seen = judgement.moved(&circle.disc, &self.view.stretch(&circle.disc));
        (decision.judged, decision.seen) = (Some(judged), Some(seen));
        if judged < min_judged {
            return;
        }
        let features = ColourFeatures::new(self.view, circle, z);
        decision.features = Some(Features::Colour(features));
        let log_odds = self.classifier.colour_log_odds(&features, judged);
        if probability(log_odds) < least {
            return;
        }
        decision.free_fit =
            FreeFitResidual::new(self.view, circle, circle.disc.radius, boundary, *locked);
        decision.score = decision
            .free_fit
            .map_or(0.0, |free| probability(log_odds - self.classifier.colour_penalty(&free)));
    }
}

/// Returns 0 up to `low`, 1 from `high`, and a straight line between.
fn ramp(x: f64, low: f64, high: f64) -> f64 {
    ((x - low) / (high - low)).clamp(0.0, 1.0)
}
