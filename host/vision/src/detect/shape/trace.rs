//! What each stage found in a frame.

use super::decide::Decision;
use super::propose::{OddsMap, Proposal};
use super::pyramid::Window;
use super::ray_colours::RAYS;
use super::refine::{RayEnd, RefinedCircle};
use super::view::Disc;

/// What each stage found in a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DetectionTrace {
    /// The searches, in their order: of the window around the previous ball, of the whole image.
    pub searches: Vec<SearchTrace>,
}

/// What each stage found in one window.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchTrace {
    /// The window.
    pub window: Window,
    /// Propose: discs of the spheres in depth, the best first.
    pub spheres: Vec<Disc>,
    /// Propose: log-odds of each place by the network, at a quarter of the size and then at smaller
    /// parts; none if a sphere ended the search.
    pub odds: Vec<OddsMap>,
    /// Propose: the places with the highest odds, for each size the most promising first.
    pub proposals: Vec<Proposal>,
    /// Refine and decide: the candidates, in the order in which they were refined.
    pub candidates: Vec<CandidateTrace>,
    /// Index of the candidate with the highest score.
    pub best: Option<usize>,
}

impl SearchTrace {
    /// Makes the trace of a search that found nothing yet.
    pub(super) fn new(window: Window) -> Self {
        Self {
            window,
            spheres: Vec::new(),
            odds: Vec::new(),
            proposals: Vec::new(),
            candidates: Vec::new(),
            best: None,
        }
    }

    /// Returns the number of proposals that were not judged.
    pub fn left_out(&self) -> usize {
        self.proposals.iter().filter(|proposal| !proposal.is_judged).count()
    }

    /// Returns the candidate with the highest score.
    pub fn best(&self) -> Option<&CandidateTrace> {
        self.best.and_then(|best| self.candidates.get(best))
    }
}

/// A refined candidate and the decision about it.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateTrace {
    /// The disc that the refinement started from.
    pub start: Disc,
    /// The refined circle.
    pub circle: RefinedCircle,
    /// What each ray shows where the disc ends.
    pub ray_ends: [RayEnd; RAYS],
    /// Column and row of that place, pixels; `None` behind the camera. Off the optical axis the
    /// places lie on an ellipse.
    pub ray_places: [Option<(f64, f64)>; RAYS],
    /// The decision; `None` if the ball cannot have the circle's size.
    pub decision: Option<Decision>,
}

impl CandidateTrace {
    /// Returns the score, 0 to 1.
    pub fn score(&self) -> f64 {
        self.decision.as_ref().map_or(0.0, |decision| decision.score)
    }
}
