//! Multi-model filter: extended Kalman filters with different first guesses, and their mixture.

use plumb_protocol::dimension::{AXES, MOTORS};

use super::filter::Filter;
use super::geometry::{
    Guess, Matrix, Vector, along, dot, length, projected, scaled, solve, transposed_times,
};
use super::known_rig::KnownRig;
use super::observation::Observation;
use crate::vector::{per_axis, per_motor};

/// Gravity, mm/s².
pub(super) const GRAVITY: f32 = 9810.0;
/// Share of its tension at rest that each cable keeps.
const MIN_TENSION_SHARE: f32 = 0.45;
/// Weight below which a hypothesis is ignored where the most cautious one decides.
const MIN_WEIGHT: f32 = 0.05;
/// Least share of the distance by J that the cables' lengths may leave. A filter far from the truth
/// must not stop the motors.
const MIN_BENT_SHARE: f32 = 0.5;
/// Exponent on the likelihoods, over 1/2. The springs' errors are correlated from measurement to
/// measurement, so that these tell less than independent ones would.
const LIKELIHOOD_EXPONENT: f32 = 0.2;
/// Least logarithm of a weight over the best one's.
const MIN_LOG_WEIGHT: f32 = -60.0;
/// Advantage in score (twice the log-likelihood) with which another filter becomes the best one,
/// whose covariance is used.
const MIN_ADVANTAGE: f32 = 2.0;

/// First guesses. The population's heights are 100 to 1000 mm and its steps 0.16 to 0.94 mm. The
/// last guess is the rig that moves most for a step, high and narrow: it keeps the first move from
/// going too far.
const GUESSES: [Guess; 4] = [
    Guess { height: 350.0, width: 1.0, step: 0.26 },
    Guess { height: 350.0, width: 1.0, step: 0.6 },
    Guess { height: 750.0, width: 1.0, step: 0.26 },
    Guess { height: 800.0, width: 0.7, step: 0.75 },
];

/// Place of the guess that a known rig replaces.
const KNOWN: usize = GUESSES.len() - 1;
/// Score with which the guesses begin beside a known rig: together they have 29 % of the
/// weight. With 20 a rig that is known well is no quicker, and one that was measured 40 % wrong
/// slower (docs/understand/results.md).
const SCORE_BESIDE_KNOWN: f32 = 10.0;

/// Extended Kalman filters over the geometry, one for each guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MultiModelFilter {
    filters: [Filter; GUESSES.len()],
    /// Index of the best filter.
    best: usize,
    /// Whether the filter in the place [`KNOWN`] is that of a known rig.
    is_known: bool,
}

/// Estimate of one filter.
#[derive(Debug, Clone, Copy)]
struct Hypothesis {
    /// Weight in the mixture; all weights sum to 1.
    weight: f32,
    /// Position of the ball, mm.
    ball: Vector,
    /// J, mm/step, of the signs Σ.
    j: Matrix,
    /// Cable of a step, mm.
    step: f32,
    /// Motor steps to the target by the cables' lengths.
    steps: Vector,
}

/// Mixture of the filters' estimates.
#[derive(Debug, Clone)]
pub(super) struct Mixture {
    /// The best filter.
    best: Filter,
    hypotheses: [Hypothesis; GUESSES.len()],
    /// Mean of J, mm/step, of the signs Σ.
    pub(super) j: Matrix,
    /// Position of the ball by the best filter, mm.
    pub(super) ball: Vector,
    /// Mean height of the motors above the ball, mm.
    pub(super) height: f32,
}

impl MultiModelFilter {
    /// Creates the filters at the first measurement, on the way to `target` (mm).
    pub(super) fn new(seen: &Observation, target: Vector) -> Self {
        let filters = GUESSES.map(|guess| Filter::new(seen, target, &guess));
        Self { filters, best: 0, is_known: false }
    }

    /// Creates the filters at the first measurement, as [`new`](Self::new), one of them with a rig
    /// that an earlier run has learnt.
    #[cold]
    pub(super) fn knowing(seen: &Observation, target: Vector, known: &KnownRig) -> Self {
        let mut all = Self::new(seen, target);
        if let Some(known) = Filter::knowing(seen, known.begin(seen)) {
            for filter in &mut all.filters {
                filter.begin_behind(SCORE_BESIDE_KNOWN);
            }
            all.filters[KNOWN] = known;
            (all.best, all.is_known) = (KNOWN, true);
        }
        all
    }

    /// Returns whether a filter has the rig of an earlier run, or of a tape measure.
    pub(super) fn is_known(&self) -> bool {
        self.is_known
    }

    /// Returns the rig as the best filter knows it; `None` while it knows too little.
    pub(super) fn known_rig(&self) -> Option<KnownRig> {
        KnownRig::of(&self.filters[self.best])
    }

    /// Updates the filters by a measurement on the way to `target` (mm). A filter that is no longer
    /// valid restarts with the worst score.
    pub(super) fn update(&mut self, seen: &Observation, target: Vector) {
        let worst = self.filters.iter().fold(0.0, |worst: f32, filter| worst.max(filter.score()));
        for (filter, guess) in self.filters.iter_mut().zip(&GUESSES) {
            filter.update(seen);
            if !filter.is_valid() {
                *filter = Filter::restarted(seen, target, guess, worst);
            }
        }
        if self.is_known && self.is_changed() {
            self.filters[KNOWN] = Filter::restarted(seen, target, &GUESSES[KNOWN], worst);
            self.is_known = false;
        }
        for i in 0..GUESSES.len() {
            if self.filters[i].score() < self.filters[self.best].score() - MIN_ADVANTAGE {
                self.best = i;
            }
        }
    }

    /// Returns whether a guess explains the measurements better than the known rig: that was
    /// changed since.
    fn is_changed(&self) -> bool {
        let (guesses, known) = self.filters.split_at(KNOWN);
        guesses.iter().any(|guess| known.iter().all(|known| guess.score() < known.score()))
    }

    /// Returns the mixture of the estimates, weighted by their likelihoods.
    pub(super) fn mixture(&self, target: Vector) -> Mixture {
        let least = self.filters.iter().fold(f32::MAX, |least, filter| least.min(filter.score()));
        let likelihoods = self
            .filters
            .each_ref()
            .map(|f| libm::expf((LIKELIHOOD_EXPONENT * (least - f.score())).max(MIN_LOG_WEIGHT)));
        let all: f32 = likelihoods.iter().sum();
        let mut j = [[0.0; MOTORS]; AXES];
        let mut height = 0.0;
        let hypotheses = core::array::from_fn(|i| {
            let (filter, weight) = (&self.filters[i], likelihoods[i] / all);
            let own = filter.jacobian();
            for (mean, own) in j.iter_mut().flatten().zip(own.iter().flatten()) {
                *mean += weight * own;
            }
            height += weight * filter.height();
            let steps = filter.steps_to(target);
            let (ball, step) = (filter.ball(), filter.step());
            Hypothesis { weight, ball, j: projected(&own), step, steps }
        });
        let best = self.filters[self.best];
        Mixture { best, hypotheses, j: projected(&j), ball: best.ball(), height }
    }
}

/// Returns the length of the level part of `v`.
#[inline(never)]
fn level(v: Vector) -> f32 {
    length([v[0], v[1], 0.0])
}

/// Returns the level acceleration of the ball away from a motor at which its cable becomes slack,
/// mm/s²: the column `j` of J is along the cable.
#[inline(never)]
fn slack_acceleration(j: Vector) -> f32 {
    GRAVITY * j[2].abs() / level(j).max(1e-6)
}

impl Hypothesis {
    /// Returns the largest factor on the motors' acceleration `a` with which every cable keeps its
    /// share of the tension.
    fn tension_factor(&self, a: Vector) -> f32 {
        // T/m = -J'(g ẑ + J a), up to the step's length.
        let change = transposed_times(&self.j, along(&self.j, a));
        let at_rest = self.j[2].map(|j| GRAVITY * j.abs());
        at_rest
            .iter()
            .zip(change)
            .filter(|(_, change)| *change > 0.0)
            .fold(f32::MAX, |least, (rest, change)| {
                least.min((1.0 - MIN_TENSION_SHARE) * rest / change)
            })
    }

    /// Returns the steps along `unit` that are left to `target` after the motors' coming movement
    /// `due`: by J, or by the cables' lengths where that is less. Near the motors J grows along the
    /// way, and steps by J alone overshoot.
    fn steps_left(&self, target: Vector, due: Vector, unit: Vector) -> f32 {
        let moves = along(&self.j, due);
        let e = per_axis(|i| target[i] - self.ball[i] - moves[i]);
        let a_step = along(&self.j, unit);
        let straight = dot(e, a_step) / dot(a_step, a_step).max(1e-9);
        let to_go = per_motor(|k| self.steps[k] - due[k]);
        let bent = dot(to_go, unit) / dot(unit, unit).max(1e-9);
        straight.min(bent.max(MIN_BENT_SHARE * straight)).max(0.0)
    }
}

impl Mixture {
    /// Returns the hypotheses of enough weight.
    fn plausible(&self) -> impl Iterator<Item = &Hypothesis> {
        self.hypotheses.iter().filter(|hypothesis| hypothesis.weight > MIN_WEIGHT)
    }

    /// Returns the largest factor on the motors' acceleration `a` with which every cable keeps its
    /// share of the tension under every plausible hypothesis.
    pub(super) fn tension_factor(&self, a: Vector) -> f32 {
        self.plausible().fold(f32::MAX, |least, hypothesis| least.min(hypothesis.tension_factor(a)))
    }

    /// Returns the steps along `unit` that are left to `target` (mm) after the motors' coming
    /// movement `due`: the least of all plausible hypotheses, at most `most`.
    pub(super) fn steps_left(&self, target: Vector, due: Vector, unit: Vector, most: f32) -> f32 {
        self.plausible()
            .fold(most, |least, hypothesis| least.min(hypothesis.steps_left(target, due, unit)))
    }

    /// Returns the covariance of J a, mm²: of the best filter, and of the hypotheses about their
    /// mean.
    fn covariance(&self, a: Vector) -> Matrix {
        let mean = along(&self.j, a);
        let mut covariance = self.best.covariance(a);
        for hypothesis in &self.hypotheses {
            let own = along(&hypothesis.j, a);
            let off = per_axis(|i| own[i] - mean[i]);
            for (row, v) in covariance.iter_mut().zip(off) {
                *row = per_motor(|k| row[k] + hypothesis.weight * v * off[k]);
            }
        }
        covariance
    }

    /// Returns the standard deviation of the part of the acceleration J a that may slacken a cable,
    /// mm per motor unit: the level part across the intended direction, and the part along it that
    /// may reverse it. An error in size alone keeps the direction, for which there is room, and a
    /// vertical error is small beside gravity.
    pub(super) fn lateral_sigma(&self, a: Vector) -> f32 {
        let intended = along(&self.j, a);
        let covariance = self.covariance(a);
        let level = level(intended).max(1e-9);
        let unit = scaled([intended[0], intended[1], 0.0], 1.0 / level);
        let lengthwise = dot(unit, along(&covariance, unit)).max(0.0);
        let across = (covariance[0][0] + covariance[1][1] - lengthwise).max(0.0);
        let back = (libm::sqrtf(lengthwise) - level / 2.0).max(0.0);
        libm::sqrtf(across + back * back)
    }

    /// Returns how near the motors' acceleration `a` (steps/s²) comes to a slack cable, by the mean
    /// of J: the level acceleration of the ball over the one at which the first cable becomes
    /// slack, where the ball accelerates straight away from it.
    pub(super) fn slack_ratio(&self, a: Vector) -> f32 {
        let slack = (0..MOTORS).map(|k| slack_acceleration(per_axis(|i| self.j[i][k])));
        level(along(&self.j, a)) / slack.fold(f32::MAX, f32::min)
    }

    /// Returns the tension of each cable over the ball's weight while the ball rests, -J'ẑ with J
    /// over the cable of a step: the mean of the hypotheses.
    pub(super) fn tensions_at_rest(&self) -> Vector {
        self.hypotheses.iter().fold([0.0; MOTORS], |sum, Hypothesis { weight, j, step, .. }| {
            per_motor(|k| sum[k] - weight * j[2][k] / step)
        })
    }

    /// Returns the motor steps that move the ball by `e` (mm), by the mean of J.
    pub(super) fn steps(&self, e: Vector) -> Option<Vector> {
        solve(&self.j, e)
    }
}
