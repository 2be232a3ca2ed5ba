//! What each stage found in a frame.

use super::decide::Decision;
use super::downsampled::{LikenessMap, Window};
use super::propose::Proposal;
use super::radial_scan::RAYS;
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
    /// Likeness to the ball's colour, which the proposals are found in.
    pub likeness: LikenessMap,
    /// Propose: discs of the spheres in depth, the best first.
    pub spheres: Vec<Disc>,
    /// Propose: blobs of the ball's colour, the strongest first. Empty if a sphere ended the
    /// search.
    pub blobs: Vec<Proposal>,
    /// Propose: the seeds among the blobs.
    pub seeds: Vec<Disc>,
    /// Refine and decide: the candidates, in the order in which they were refined.
    pub candidates: Vec<CandidateTrace>,
    /// Index of the candidate with the highest score.
    pub best: Option<usize>,
}

impl SearchTrace {
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
    /// The decision; `None` if the ball cannot have the circle's size.
    pub decision: Option<Decision>,
}

impl CandidateTrace {
    /// Returns the score, 0 to 1.
    pub fn score(&self) -> f64 {
        self.decision.as_ref().map_or(0.0, |decision| decision.score)
    }
}
