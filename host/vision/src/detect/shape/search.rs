//! The search of a window: proposals are refined and decided about until one is certain.

use super::decide::{Decider, screen};
use super::parameters::SearchParameters;
use super::propose::{Proposal, find_spheres, propose, sphere_at};
use super::pyramid::{QUARTER_LEVEL, Window};
use super::refine::{Candidate, refine};
use super::robust_fit::median;
use super::trace::{CandidateTrace, SearchTrace};
use super::view::{Disc, FrameView};

/// Factor by which a proposal may be larger or smaller than the ball can be.
const MAX_START: f64 = 1.5;

/// A search in progress.
struct Search<'a> {
    view: &'a FrameView<'a>,
    parameters: &'a SearchParameters,
    decider: Decider<'a>,
    trace: SearchTrace,
}

/// Where a refinement starts.
struct Start {
    disc: Disc,
    /// Whether depth shows a sphere there: the circle must not move far.
    locked: bool,
    /// Log-odds by the screen; infinite for a sphere that was found without it.
    log_odds: f64,
}

/// Searches `window`, which the levels of `view` show.
pub(super) fn search(view: &FrameView, window: Window) -> SearchTrace {
    let trace = SearchTrace::new(window);
    let parameters = &view.parameters.search;
    let mut search = Search { view, parameters, decider: Decider::new(view), trace };
    if !search.try_spheres() {
        // Balls that are too large for one level are looked for at the next one. With depth, balls
        // of up to twice that size were found as spheres.
        let least = if view.has_depth { QUARTER_LEVEL + 2 } else { QUARTER_LEVEL };
        let last = view.levels.len() - 1;
        for level in QUARTER_LEVEL..=if last < least { QUARTER_LEVEL } else { last } {
            search.try_proposals(level);
            if search.has_found() {
                break;
            }
        }
    }
    search.trace
}

impl Search<'_> {
    /// Tries the spheres in depth. Returns whether one of them is certain.
    fn try_spheres(&mut self) -> bool {
        let spheres = find_spheres(self.view);
        self.trace.spheres =
            spheres.iter().filter_map(|centre| self.view.disc_of(centre)).collect();
        let mut left = self.parameters.max_spheres;
        for i in 0..self.trace.spheres.len() {
            let disc = self.trace.spheres[i];
            if left == 0 {
                break;
            }
            if self.decider.passes(&disc) {
                left -= 1;
                if self.consider(&Start { disc, locked: true, log_odds: f64::INFINITY }) {
                    return true;
                }
            }
        }
        false
    }

    /// Tries the proposals at `level`, the likeliest first, until one is certain, the budget is
    /// spent, or a ball is found that is clearly likelier than the rest.
    fn try_proposals(&mut self, level: usize) {
        let (odds, mut proposals) = propose(self.view, &self.view.levels[level]);
        self.trace.odds.push(odds);
        let budget = proposals.len().min(self.view.parameters.propose.max_judged);
        let (mut judged, mut left) = (0, self.parameters.max_refined);
        // A place that is likely the ball ends the judging. If no ball is there, it goes on.
        while judged < budget && left > 0 {
            let starts = self.starts(&mut proposals[..budget], &mut judged);
            self.try_starts(&starts, &mut left);
            if self.has_found() {
                break;
            }
        }
        self.trace.proposals.extend(proposals);
    }

    /// Refines at most `left` of `starts`, until one is certain, or a ball is found that is clearly
    /// likelier than the rest.
    fn try_starts(&mut self, starts: &[Start], left: &mut usize) {
        let mut found: Option<f64> = None;
        for start in starts {
            let is_rival =
                found.is_none_or(|odds| start.log_odds > odds - self.parameters.rival_log_odds);
            if *left == 0 || !is_rival {
                break;
            }
            *left -= 1;
            if self.consider(start) {
                break;
            }
            if self.has_found() {
                found = found.or(Some(start.log_odds));
            }
        }
    }

    /// Checks whether the best candidate so far is a ball.
    fn has_found(&self) -> bool {
        self.trace.best().is_some_and(|best| best.score() >= self.parameters.min_score)
    }

    /// Judges `proposals` from the first one that is not `judged` yet, the most promising first,
    /// until all are judged, or one is so likely the ball that less promising ones need no look.
    /// Returns where to refine them, the likeliest first.
    fn starts(&self, proposals: &mut [Proposal], judged: &mut usize) -> Vec<Start> {
        let parameters = &self.view.parameters.propose;
        let least = proposals[*judged].log_odds - parameters.rival_log_odds;
        let mut starts: Vec<Start> = Vec::new();
        for proposal in &mut proposals[*judged..] {
            let is_rival = proposal.log_odds > least;
            if !is_rival && starts.iter().any(|start| start.log_odds > parameters.likely) {
                break;
            }
            *judged += 1;
            proposal.is_judged = true;
            starts.extend(self.start(proposal));
        }
        starts.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        starts
    }

    /// Returns where to refine a proposal: where the screen sees the ball, or at the sphere in
    /// depth there. Returns `None` if it sees none, or not of a possible size.
    fn start(&self, proposal: &Proposal) -> Option<Start> {
        let by_depth = |disc: &Disc| {
            let surface = self.median_depth(disc)?;
            Some(self.view.radius_at(surface + self.view.ball_radius))
        };
        let disc = proposal.disc;
        let mut disc = Disc { radius: by_depth(&disc).unwrap_or(disc.radius), ..disc };
        let mut log_odds = f64::NEG_INFINITY;
        let parameters = &self.view.parameters.propose;
        let possible_radii = self.view.radii_up_to(MAX_START);
        for least in [parameters.min_judged, parameters.min_judged_again] {
            if !possible_radii.contains(&disc.radius) {
                return None;
            }
            let judgement = screen(self.view, &disc);
            log_odds = judgement.log_odds;
            if log_odds < least {
                return None;
            }
            disc = judgement.moved(&disc, &self.view.stretch(&disc));
        }
        let surface = self.median_depth(&disc);
        let sphere = surface.and_then(|z| sphere_at(self.view, &disc, z));
        let at_sphere = sphere.and_then(|centre| self.view.disc_of(&centre));
        let locked = at_sphere.is_some();
        Some(Start { disc: at_sphere.unwrap_or(disc), locked, log_odds })
    }

    /// Returns the median depth, metres, of nine pixels about the middle of `disc`; `None` if too
    /// few have depth.
    fn median_depth(&self, disc: &Disc) -> Option<f64> {
        let parameters = &self.view.parameters.propose;
        let offset = |k: i32| f64::from(k - 1) * parameters.depth_spacing * disc.radius;
        let places = (0..9).map(|i| (disc.u + offset(i % 3), disc.v + offset(i / 3)));
        let depths: Vec<f64> = places.filter_map(|(u, v)| self.view.depth.at(u, v)).collect();
        if depths.len() >= parameters.min_depths { median(depths) } else { None }
    }

    /// Refines the disc at `start` and decides about it, unless a candidate before it started or
    /// ended there. Without depth, does the same where the judge sees the ball, as long as that is
    /// elsewhere or the candidate is rejected. Returns whether the best candidate is certain.
    fn consider(&mut self, start: &Start) -> bool {
        let Start { disc: start, locked, .. } = *start;
        let known =
            self.trace.candidates.iter().flat_map(|known| [&known.start, &known.circle.disc]);
        if known.into_iter().any(|disc| self.is_same(disc, &start)) {
            return false;
        }
        self.add_candidate(start, locked);
        for least in self.parameters.min_judged_beside {
            let Some(seen) = self.seen_ball(least) else { break };
            self.add_candidate(seen, true);
        }
        self.trace.best().is_some_and(|best| best.score() > self.parameters.certain_score)
    }

    /// Returns where the judge sees the ball if it gives the last candidate, one without depth,
    /// more than `least` log-odds, and the candidate was rejected or the judge sees the ball beside
    /// the circle: some of the circle's edges may be the background's.
    fn seen_ball(&self, least: f64) -> Option<Disc> {
        let candidate = self.trace.candidates.last()?;
        let decision = candidate.decision.as_ref()?;
        let (circle, seen) = (&candidate.circle.disc, decision.seen?);
        let off = seen.distance(circle) + (seen.radius - circle.radius).abs();
        let is_rejected = candidate.score() < self.parameters.min_score;
        let is_beside = off > self.parameters.min_beside * circle.radius;
        let is_ball = decision.judged? > least;
        (is_ball && (is_rejected || is_beside)).then_some(seen)
    }

    /// Refines the disc at `start` and decides about it. A `locked` start must not move far.
    fn add_candidate(&mut self, start: Disc, locked: bool) {
        let candidate = refine(self.view, &start, locked);
        let best = self.trace.best().map(CandidateTrace::score);
        let least =
            best.map_or(self.parameters.min_score, |best| best.max(self.parameters.min_score));
        let decision = self
            .view
            .possible_radii()
            .contains(&candidate.circle.disc.radius)
            .then(|| self.decider.decide(&candidate, least));
        let Candidate { circle, outline, ray_places, .. } = candidate;
        let ray_ends = outline.ends;
        let candidate = CandidateTrace { start, circle, ray_ends, ray_places, decision };
        let score = candidate.score();
        // Of equal scores the first one counts: it was the more promising one.
        if best.is_none_or(|best| score > best) {
            self.trace.best = Some(self.trace.candidates.len());
        }
        self.trace.candidates.push(candidate);
    }

    /// Checks whether two discs would be refined to one circle.
    fn is_same(&self, a: &Disc, b: &Disc) -> bool {
        let least = a.radius.min(b.radius);
        a.distance(b) < self.parameters.same_centre * least
            && (a.radius - b.radius).abs() < self.parameters.same_radius * least
    }
}
