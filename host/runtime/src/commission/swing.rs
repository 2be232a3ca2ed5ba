//! Stiffness of the cables from the swing of the ball while one motor turns to and fro.
//!
//! Along its slowest mode ([`Mode`](super::mode::Mode)) the ball at x follows the place r that it
//! would have on cables that do not stretch: ẍ = -ω² (x - r) - 2ζω (ẋ - ṙ), ω = 2π/T. The motion
//! of the motor is known, so that each period T gives a curve. [`Watch::judge`] compares the
//! curves of all periods with the measured places and asks which explain them.
//!
//! A running mean of the span S leaves the part |sin(πS/T) / (πS/T)| of a swing of the period T.
//! Of periods below S at most 0.217 remains (the first side lobe, S = 1.43 T), and of longer ones
//! more and more: 0.217 at S = 0.813 T. The span for stiff cables, 0.25 s, is safe up to a period
//! of 0.25 s / 0.813 = 0.307 s.
//!
//! The period depends on the place of the ball: it grows with σ of the mode. On nine places of ten
//! in the population of rigs σ is at most [`COMMON_GAIN`] (`tests/tests/it/stiffness.rs` measures
//! it). The period that counts is therefore T max(1, [`COMMON_GAIN`] / σ).

#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use crate::rig::{STIFF_MEAN, Stiffness};

/// Span over the longest period of which a running mean leaves no more than of shorter ones.
const SPAN_PER_PERIOD: f64 = 0.813;

/// σ at nine places of ten: the ball swings more slowly there than at the place of the check.
pub const COMMON_GAIN: f64 = 2.45;

/// Shortest period in question beside rigid cables, seconds: two pictures at 30 Hz.
const SHORTEST_S: f64 = 0.06;

/// Longest period in question, seconds: 50 N/m with 0.3 kg at σ = 2.5.
const LONGEST_S: f64 = 1.2;

/// Ratio of a period to the next shorter one.
const PERIOD_RATIO: f64 = 1.06;

/// Damping ratios ζ of the mode. Steel, braided line, nylon and rubber are within them.
const DAMPINGS: [f64; 5] = [0.01, 0.03, 0.06, 0.1, 0.15];

/// Least time from a jog on the clock of the pictures to the true one, seconds: the latency of a
/// camera may be given too large.
const LEAST_DELAY_S: f64 = -0.06;

/// Step of the delays, seconds.
const DELAY_S: f64 = 0.015;

/// Number of the delays.
const DELAYS: u32 = 11;

/// First step of a refinement in the damping ratio.
const DAMPING_STEP: f64 = 0.03;

/// Number of rounds of a refinement.
const REFINEMENTS: u32 = 14;

/// Difference of the misfits, in variances, from which on one explanation is preferred. For white
/// noise a wrong one is preferred with a probability below exp(-12).
const MARGIN: f64 = 25.0;

/// Largest misfit for a place, in variances, of motion that is explained.
const EXPLAINED: f64 = 2.5;

/// Distance from the median at which a measured place counts as that of another thing, metres.
const OUTLIER_M: f64 = 0.04;

/// Least scatter of the measured places of a ball at rest, metres.
const LEAST_SCATTER_M: f64 = 1e-6;

/// Least number of places at rest, and of those after the first jog.
const LEAST_PLACES: [usize; 2] = [20, 60];

/// Least number of places a second: four for the shortest swing of soft cables.
const LEAST_RATE: f64 = 15.0;

/// Parameters that a fit has: offset, gain, period, damping, delay.
const PARAMETERS: f64 = 5.0;

/// Time step of a curve, seconds.
const TICK_S: f64 = 0.002;

/// Measured place of the ball along its slowest mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// Time of the picture, seconds.
    pub(super) time: f64,
    /// Place along the mode, metres.
    pub(super) along: f64,
}

/// A jog of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    /// Begin, seconds.
    pub(super) begin: f64,
    /// Distance, full steps, + pays out.
    pub(super) steps: f64,
}

/// Jogs of one motor, each of which begins after the end of the one before.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drive {
    /// The jogs in their order.
    pub(super) turns: Vec<Turn>,
    /// Highest rate, full steps/s.
    pub(super) rate: f64,
    /// Acceleration, full steps/s².
    pub(super) acceleration: f64,
}

impl Drive {
    /// Returns the rate of the motor at `time`, full steps/s: a trapezoid for each jog.
    fn rate_at(&self, time: f64) -> f64 {
        let under_way = self.turns.iter().rev().find(|turn| turn.begin <= time);
        let Some(Turn { begin, steps }) = under_way else { return 0.0 };
        let highest = self.rate.min((self.acceleration * steps.abs()).sqrt());
        let length = steps.abs() / highest + highest / self.acceleration;
        let (since, left) = (time - begin, begin + length - time);
        let ramp = self.acceleration * since.min(left).max(0.0);
        ramp.min(highest) * steps.signum()
    }

    /// Returns the rates at `count` ticks from `begin` on, full steps/s.
    fn rates(&self, begin: f64, count: usize) -> Vec<f64> {
        (0..count).map(|tick| self.rate_at(begin + tick as f64 * TICK_S)).collect()
    }
}

/// Oscillation of a ball on its cables.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Oscillator {
    /// Period, seconds; 0 on cables that do not stretch.
    period: f64,
    /// Damping ratio.
    damping: f64,
}

impl Oscillator {
    const RIGID: Self = Self { period: 0.0, damping: 0.0 };

    /// Returns the place of the ball at each tick for these rates of the motor (full steps/s), in
    /// steps of the motor. It integrates ÿ = -r̈ - 2ζω ẏ - ω² y for the distance y = x - r.
    fn curve(self, rates: &[f64]) -> Vec<f64> {
        let omega = if self.period > 0.0 { TAU / self.period } else { 0.0 };
        let (mut turned, mut distance, mut speed) = (0.0, 0.0, 0.0);
        let tick = |pair: &[f64]| {
            turned += TICK_S * (pair[0] + pair[1]) / 2.0;
            if omega > 0.0 {
                let pull = 2.0 * self.damping * omega * speed + omega * omega * distance;
                speed += pair[0] - pair[1] - TICK_S * pull;
                distance += TICK_S * speed;
            }
            turned + distance
        };
        std::iter::once(0.0).chain(rates.windows(2).map(tick)).collect()
    }
}

/// Explanation of the measured places.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fit {
    oscillator: Oscillator,
    /// Time from a jog on the clock of the pictures to the true one, seconds.
    delay: f64,
    /// Sum of the squared residuals, m².
    misfit: f64,
}

/// Places of the ball while one motor turns to and fro.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Watch {
    /// Places before the first jog.
    pub(super) at_rest: Vec<Sample>,
    /// Places from then on.
    pub(super) moved: Vec<Sample>,
    /// Jogs.
    pub(super) drive: Drive,
    /// σ of the mode.
    pub(super) gain: f64,
}

/// Stiffness of the cables by measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measurement {
    /// The ball swings fast, or not at all: the shorter running mean is enough.
    Stiff {
        /// Slowest period, seconds; `None` where no swing is seen.
        period_s: Option<f64>,
    },
    /// The ball swings slowly.
    Soft {
        /// Slowest period, seconds.
        period_s: f64,
    },
    /// It could not be told.
    Unknown(Doubt),
}

impl Measurement {
    /// Returns the value of `cables.stiffness` that is proposed; `None` where it could not be told.
    #[must_use]
    pub fn proposal(&self) -> Option<Stiffness> {
        match self {
            Self::Stiff { .. } => Some(Stiffness::Stiff),
            Self::Soft { .. } => Some(Stiffness::Soft),
            Self::Unknown(_) => None,
        }
    }
}

/// Reason that the stiffness could not be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Doubt {
    /// The steps before found a fault.
    #[error("the faults above come first")]
    Fault,
    /// The travel has no room for the jogs.
    #[error("the motor is at the end of its travel")]
    Travel,
    /// The link is too slow to know when a jog began.
    #[error("the link to the board was too slow")]
    Link,
    /// Pictures came late, so that their times are not sure either.
    #[error("pictures came late or were lost, as on a busy computer; run the check again")]
    Late,
    /// The ball is seen in too few pictures.
    #[error("the ball was seen in too few pictures")]
    Pictures,
    /// The measured places fit neither stiff nor soft cables that are taut.
    #[error(
        "the measured places fit neither stiff nor soft cables; check again with the ball nearer \
         to the middle of the triangle (`plumb goto` to a target of the rig file), taut cables, \
         and no other program at work on this computer"
    )]
    Unexplained,
    /// Slow and fast swings explain the places about as well.
    #[error("the swing is too small for the noise of the camera")]
    Noise,
}

impl Watch {
    /// Returns the longest period at this place for which the span of stiff cables is safe,
    /// seconds.
    fn longest_safe(&self) -> f64 {
        STIFF_MEAN.get() / SPAN_PER_PERIOD * (self.gain / COMMON_GAIN).min(1.0)
    }

    /// Returns what the places tell.
    pub(super) fn judge(&self) -> Measurement {
        let moved = without_outliers(&self.moved);
        let Some(scatter) = scatter(&self.at_rest).filter(|_| self.has_enough(&moved)) else {
            return Measurement::Unknown(Doubt::Pictures);
        };
        let curves = Curves::of(&self.drive, &moved);
        let longest_safe = self.longest_safe();
        let [slow, fast] =
            [true, false].map(|is_slow| curves.best(|period| (period > longest_safe) == is_slow));
        let variance = scatter * scatter;
        let per_sample = slow.misfit.min(fast.misfit) / (moved.len() as f64 - PARAMETERS);
        // Noise that is larger than at rest makes a difference smaller.
        let unit = variance.max(per_sample);
        let preference = (slow.misfit - fast.misfit) / unit;
        if per_sample > EXPLAINED * variance {
            Measurement::Unknown(Doubt::Unexplained)
        } else if preference > MARGIN {
            let rigid = curves.best(|period| period == 0.0);
            let is_seen = (rigid.misfit - fast.misfit) / unit > MARGIN;
            Measurement::Stiff { period_s: is_seen.then_some(fast.oscillator.period) }
        } else if preference < -MARGIN {
            Measurement::Soft { period_s: slow.oscillator.period }
        } else {
            Measurement::Unknown(Doubt::Noise)
        }
    }

    fn has_enough(&self, moved: &[Sample]) -> bool {
        let [at_rest, least] = LEAST_PLACES;
        let (Some(first), Some(last)) = (moved.first(), moved.last()) else { return false };
        let rate = moved.len() as f64 / (last.time - first.time);
        self.at_rest.len() >= at_rest && moved.len() >= least && rate >= LEAST_RATE
    }
}

/// Curves of all oscillators beside the measured samples.
struct Curves<'a> {
    samples: &'a [Sample],
    /// Time of the first tick of a curve, seconds.
    begin: f64,
    /// Rates of the motor at each tick, full steps/s.
    rates: Vec<f64>,
}

impl<'a> Curves<'a> {
    fn of(drive: &Drive, samples: &'a [Sample]) -> Self {
        let begin = drive.turns.first().map_or(0.0, |turn| turn.begin) - TICK_S;
        let end = samples.last().map_or(begin, |sample| sample.time) - LEAST_DELAY_S;
        let count = ((end - begin).max(0.0) / TICK_S).ceil() as usize + 2;
        Self { samples, begin, rates: drive.rates(begin, count) }
    }

    /// Returns the best fit of the periods (seconds) that are allowed: the best one of a grid,
    /// refined.
    fn best(&self, is_allowed: impl Fn(f64) -> bool) -> Fit {
        let periods = std::iter::successors(Some(SHORTEST_S), |last| Some(last * PERIOD_RATIO));
        let periods = periods.take_while(|period| *period < LONGEST_S);
        let mut best = Fit { misfit: f64::INFINITY, ..self.fits(Oscillator::RIGID) };
        for period in std::iter::once(0.0).chain(periods).filter(|period| is_allowed(*period)) {
            for damping in DAMPINGS {
                best = best.or(self.fits(Oscillator { period, damping }));
            }
        }
        self.refined(best, is_allowed)
    }

    /// Returns the fit of this oscillator with the best delay of a grid.
    fn fits(&self, oscillator: Oscillator) -> Fit {
        let curve = oscillator.curve(&self.rates);
        let fits = (0..DELAYS).map(|number| {
            let delay = LEAST_DELAY_S + DELAY_S * f64::from(number);
            self.fit(oscillator, &curve, delay)
        });
        fits.reduce(Fit::or).unwrap_or_else(|| self.fit(oscillator, &curve, 0.0))
    }

    fn fit(&self, oscillator: Oscillator, curve: &[f64], delay: f64) -> Fit {
        let misfit = residual(self.samples, curve, self.begin + delay);
        Fit { oscillator, delay, misfit }
    }

    /// Searches around `best` in smaller and smaller steps of period, damping and delay.
    fn refined(&self, mut best: Fit, is_allowed: impl Fn(f64) -> bool) -> Fit {
        let [least, .., greatest] = DAMPINGS;
        let mut step = 1.0;
        for _ in 0..REFINEMENTS {
            for (longer, stronger) in [(-step, 0.0), (step, 0.0), (0.0, -step), (0.0, step)] {
                let Fit { oscillator: Oscillator { period, damping }, delay, .. } = best;
                let other = period * (1.0 + longer * (PERIOD_RATIO - 1.0));
                let oscillator = Oscillator {
                    period: if is_allowed(other) { other } else { period },
                    damping: (damping + stronger * DAMPING_STEP).clamp(least, greatest),
                };
                let curve = oscillator.curve(&self.rates);
                for later in [-step, 0.0, step] {
                    best = best.or(self.fit(oscillator, &curve, delay + later * DELAY_S));
                }
            }
            step *= 0.75;
        }
        best
    }
}

impl Fit {
    /// Returns the better one of two fits.
    fn or(self, other: Self) -> Self {
        if other.misfit < self.misfit { other } else { self }
    }
}

/// Returns the sum of the squared residuals (m²) of `places` from `curve`, which begins at `begin`
/// seconds, with the offset and the gain that fit best.
fn residual(places: &[Sample], curve: &[f64], begin: f64) -> f64 {
    let count = places.len() as f64;
    let (mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    // Differences from the first place keep the digits of the sums.
    let origin = places.first().map_or(0.0, |place| place.along);
    for place in places {
        let (expected, along) = (interpolated(curve, place.time - begin), place.along - origin);
        x += expected;
        y += along;
        xx += expected * expected;
        xy += expected * along;
        yy += along * along;
    }
    let (xx, xy, yy) = (xx - x * x / count, xy - x * y / count, yy - y * y / count);
    if xx > 0.0 { (yy - xy * xy / xx).max(0.0) } else { yy }
}

/// Returns the value of `curve` at `time` seconds from its start; its ends go on for ever.
fn interpolated(curve: &[f64], time: f64) -> f64 {
    let ticks = (time / TICK_S).max(0.0);
    let before = ticks as usize;
    match (curve.get(before), curve.get(before + 1)) {
        (Some(first), Some(second)) => first + (ticks - before as f64) * (second - first),
        _ => curve.last().copied().unwrap_or(0.0),
    }
}

/// Returns the places without those of other things than the ball.
fn without_outliers(places: &[Sample]) -> Vec<Sample> {
    let mut sorted: Vec<f64> = places.iter().map(|place| place.along).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(&median) = sorted.get(sorted.len() / 2) else { return Vec::new() };
    let is_near = |place: &&Sample| (place.along - median).abs() < OUTLIER_M;
    places.iter().filter(is_near).copied().collect()
}

/// Returns the standard deviation of a sample, metres; `None` where there is none or one alone, or
/// a camera repeats its pictures.
fn scatter(places: &[Sample]) -> Option<f64> {
    let places = without_outliers(places);
    let count = places.len() as f64;
    let mean = places.iter().map(|place| place.along).sum::<f64>() / count;
    let squares: f64 = places.iter().map(|place| (place.along - mean).powi(2)).sum();
    let scatter = (squares / (count - 1.0)).sqrt();
    (scatter > LEAST_SCATTER_M).then_some(scatter)
}
