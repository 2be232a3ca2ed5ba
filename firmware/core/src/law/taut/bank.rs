//! Filters that began with different guesses, and what they say together.

use super::filter::Filter;
use super::geometry::{
    Matrix, Vector, along, dot, length, projected, scaled, solve, transposed_times,
};
use super::prior::Guess;
use super::seen::Seen;

/// Gravity, mm/s².
pub(super) const GRAVITY: f32 = 9810.0;
/// Of its tension at rest, each cable keeps so much.
const KEPT: f32 = 0.45;
/// A filter with less than this share of the belief is not heeded where the most careful one
/// decides.
const PLAUSIBLE: f32 = 0.05;
/// Lengths of cable take no more than this from what J says is left: a filter far from the truth
/// must not bring all to a stop.
const BENT: f32 = 0.5;
/// Likelihoods count to this power over a half: what the springs do to one picture they do to the
/// next, so that pictures say less than they would if each erred for itself.
const CREDULITY: f32 = 0.2;
/// Another filter's covariance is taken when it explains what was seen better by this much (twice
/// the logarithm of likelihoods).
const BETTER: f32 = 2.0;

/// The population's heights are 100 to 1000 mm and its steps 0.16 to 0.94 mm. The last is the rig
/// that moves most for a step: high and narrow. It is what keeps the first move from going too far.
const GUESSES: [Guess; 4] = [
    Guess { height: 350.0, width: 1.0, step: 0.26 },
    Guess { height: 350.0, width: 1.0, step: 0.6 },
    Guess { height: 750.0, width: 1.0, step: 0.26 },
    Guess { height: 800.0, width: 0.7, step: 0.75 },
];

/// Extended Kalman filters over the geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bank {
    filters: [Filter; GUESSES.len()],
    best: usize,
}

/// What one filter takes for true.
#[derive(Debug, Clone, Copy)]
struct Opinion {
    /// Share of the belief.
    weight: f32,
    /// The ball, mm.
    ball: Vector,
    /// Mm a step, of the signs Σ.
    j: Matrix,
    /// Motor steps to the target, by the cables' lengths.
    steps: Vector,
}

/// What the filters say together.
#[derive(Debug, Clone)]
pub(super) struct Belief {
    best: Filter,
    opinions: [Opinion; GUESSES.len()],
    /// The mean of J, mm a step, of the signs Σ.
    pub(super) j: Matrix,
    /// The ball, mm.
    pub(super) ball: Vector,
    /// The mean of how far the motors are above the ball, mm.
    pub(super) height: f32,
}

impl Bank {
    /// At the first picture, on the way to `target` (mm).
    pub(super) fn new(seen: &Seen, target: Vector) -> Self {
        Self { filters: GUESSES.map(|guess| Filter::new(seen, target, &guess)), best: 0 }
    }

    /// Takes in a picture, on the way to `target` (mm).
    pub(super) fn update(&mut self, seen: &Seen, target: Vector) {
        let worst = self.filters.iter().fold(0.0, |worst: f32, filter| worst.max(filter.score()));
        for (filter, guess) in self.filters.iter_mut().zip(&GUESSES) {
            filter.update(seen);
            if !filter.sound() {
                *filter = Filter::restarted(seen, target, guess, worst);
            }
        }
        for i in 0..GUESSES.len() {
            if self.filters[i].score() < self.filters[self.best].score() - BETTER {
                self.best = i;
            }
        }
    }

    /// What the filters say together, each as far as it has explained what was seen.
    pub(super) fn belief(&self, target: Vector) -> Belief {
        let least = self.filters.iter().fold(f32::MAX, |least, filter| least.min(filter.score()));
        let likelihoods = self
            .filters
            .each_ref()
            .map(|f| libm::expf((CREDULITY * (least - f.score())).max(-60.0)));
        let all: f32 = likelihoods.iter().sum();
        let mut j = [[0.0; 3]; 3];
        let mut height = 0.0;
        let opinions = core::array::from_fn(|i| {
            let (filter, weight) = (&self.filters[i], likelihoods[i] / all);
            let own = filter.jacobian();
            for (mean, own) in j.iter_mut().flatten().zip(own.iter().flatten()) {
                *mean += weight * own;
            }
            height += weight * filter.height();
            Opinion {
                weight,
                ball: filter.ball(),
                j: projected(&own),
                steps: filter.steps_to(target),
            }
        });
        let best = self.filters[self.best];
        Belief { best, opinions, j: projected(&j), ball: best.ball(), height }
    }
}

impl Opinion {
    /// The largest factor on the motors' acceleration `a` with which every cable keeps its part of
    /// the tension.
    fn tension(&self, a: Vector) -> f32 {
        // T/m = -J'(g ẑ + J a), up to the step's length.
        let change = transposed_times(&self.j, along(&self.j, a));
        let at_rest = self.j[2].map(|j| GRAVITY * j.abs());
        at_rest
            .iter()
            .zip(change)
            .filter(|(_, change)| *change > 0.0)
            .fold(f32::MAX, |least, (rest, change)| least.min((1.0 - KEPT) * rest / change))
    }

    /// How many steps along `unit` are left to `target` once the motors have turned by `due`: by J,
    /// or by the cables' lengths where that is less. Near the motors a step goes farther and
    /// farther, and who goes by J alone gets past the target.
    fn left(&self, target: Vector, due: Vector, unit: Vector) -> f32 {
        let moves = along(&self.j, due);
        let e = [0, 1, 2].map(|i| target[i] - self.ball[i] - moves[i]);
        let a_step = along(&self.j, unit);
        let straight = dot(e, a_step) / dot(a_step, a_step).max(1e-9);
        let to_go = [0, 1, 2].map(|k| self.steps[k] - due[k]);
        let bent = dot(to_go, unit) / dot(unit, unit).max(1e-9);
        straight.min(bent.max(BENT * straight)).max(0.0)
    }
}

impl Belief {
    fn plausible(&self) -> impl Iterator<Item = &Opinion> {
        self.opinions.iter().filter(|opinion| opinion.weight > PLAUSIBLE)
    }

    /// The largest factor on the motors' acceleration `a` with which, by every plausible opinion,
    /// every cable keeps its part of the tension.
    pub(super) fn tension(&self, a: Vector) -> f32 {
        self.plausible().fold(f32::MAX, |least, opinion| least.min(opinion.tension(a)))
    }

    /// How many steps along `unit` are left to `target` (mm) once the motors have turned by `due`:
    /// the fewest of all plausible opinions, at most `way`.
    pub(super) fn left(&self, target: Vector, due: Vector, unit: Vector, way: f32) -> f32 {
        self.plausible().fold(way, |least, opinion| least.min(opinion.left(target, due, unit)))
    }

    /// The covariance of J a, mm²: of the best filter, and of the opinions about it.
    fn covariance(&self, a: Vector) -> Matrix {
        let mean = along(&self.j, a);
        let mut covariance = self.best.covariance(a);
        for opinion in &self.opinions {
            let own = along(&opinion.j, a);
            let off = [0, 1, 2].map(|i| own[i] - mean[i]);
            for (row, v) in covariance.iter_mut().zip(off) {
                *row = [0, 1, 2].map(|k| row[k] + opinion.weight * v * off[k]);
            }
        }
        covariance
    }

    /// The standard deviation of what may slacken a cable in the ball's acceleration J a, mm per
    /// motor unit: its level part across the way that is meant, and what of it may point backwards.
    /// An acceleration that is only greater or less than meant keeps pointing to where there is
    /// room, and what is vertical is small beside gravity.
    pub(super) fn harm(&self, a: Vector) -> f32 {
        let meant = along(&self.j, a);
        let covariance = self.covariance(a);
        let level = length([meant[0], meant[1], 0.0]).max(1e-9);
        let unit = scaled([meant[0], meant[1], 0.0], 1.0 / level);
        let lengthwise = dot(unit, along(&covariance, unit)).max(0.0);
        let across = (covariance[0][0] + covariance[1][1] - lengthwise).max(0.0);
        let back = (libm::sqrtf(lengthwise) - level / 2.0).max(0.0);
        libm::sqrtf(across + back * back)
    }

    /// Motor steps that move the ball by `e` (mm).
    pub(super) fn steps(&self, e: Vector) -> Option<Vector> {
        solve(&self.j, e)
    }
}
