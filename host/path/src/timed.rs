//! Trajectories from places with time stamps.

use nalgebra::{Point3, Vector3};

use crate::curve::whole_length;
use crate::motion::{LEAST_DISTANCE_M, Moment, PathError, Run, Sample};
use crate::quintic::Quintic;
use crate::spline::{Ends, interpolate};

/// Time in which the clock of a loop comes from rest to its full rate, seconds.
const START_S: f64 = 2.0;

/// Number of parts into which a check divides the start of a loop.
const START_PARTS: u32 = 400;

/// Least number of samples of a loop.
const LEAST_LOOP: usize = 4;

/// Trajectory with time stamps.
#[derive(Debug, Clone)]
pub(crate) struct Timed {
    pieces: Vec<Quintic>,
    /// Times of the samples after the first, seconds.
    times: Vec<f64>,
    run: Run,
}

/// Time on a trajectory's own clock.
struct ClockTime {
    /// Time, seconds.
    time: f64,
    /// Rate of the clock.
    rate: f64,
    /// Change of the rate, 1/s.
    change: f64,
}

impl Timed {
    /// Returns the trajectory through finite samples.
    pub(crate) fn new(samples: &[Sample], run: Run) -> Result<Self, PathError> {
        let count = samples.len();
        match run {
            Run::Once if count < 2 => return Err(PathError::TooFew { count, least: 2 }),
            Run::Loop if count < LEAST_LOOP => {
                return Err(PathError::TooFewInLoop { count, least: LEAST_LOOP });
            }
            Run::Once | Run::Loop => {}
        }
        let steps: Vec<f64> = samples.windows(2).map(|it| it[1].time - it[0].time).collect();
        if let Some(i) = steps.iter().position(|step| *step <= 0.0) {
            return Err(PathError::TimeNotRising { number: i + 2 });
        }
        let mut places: Vec<Vector3<f64>> = samples.iter().map(|it| it.position.coords).collect();
        let ends = match run {
            Run::Once => Ends::AtRest,
            Run::Loop => Ends::Periodic,
        };
        if run == Run::Loop {
            let gap = (places[count - 1] - places[0]).norm();
            if gap > LEAST_DISTANCE_M {
                return Err(PathError::OpenLoop { gap_mm: gap * 1e3 });
            }
            places[count - 1] = places[0];
        }
        let times = samples.iter().map(|sample| sample.time - samples[0].time).collect();
        Ok(Self { pieces: interpolate(&places, &steps, ends), times, run })
    }

    /// Returns the length of the path, metres.
    pub(crate) fn length(&self) -> f64 {
        self.pieces.iter().map(whole_length).sum()
    }

    /// Returns the time from the first to the last sample, seconds.
    pub(crate) fn duration(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Returns the time of a lap, seconds; `None` where the trajectory has an end.
    pub(crate) fn period(&self) -> Option<f64> {
        (self.run == Run::Loop).then(|| self.duration())
    }

    /// Returns the times of the samples, seconds, and in the start of a loop times close together.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        if self.run == Run::Once {
            return self.times.clone();
        }
        let start = (0..START_PARTS).map(|part| START_S * f64::from(part) / f64::from(START_PARTS));
        // The clock of a loop reaches half of the start's time at its end.
        let rest = self.times.iter().map(|time| time + START_S / 2.0);
        start.chain(rest.filter(|time| *time >= START_S)).collect()
    }

    /// Returns the time after which the trajectory holds nothing new, seconds.
    pub(crate) fn span(&self) -> f64 {
        self.duration() + if self.run == Run::Loop { START_S } else { 0.0 }
    }

    /// Returns the motion at a time after the start, seconds.
    pub(crate) fn at(&self, time: f64) -> Moment {
        let clock = self.clock(time);
        let index = self.times.partition_point(|start| *start <= clock.time);
        let index = index.clamp(1, self.pieces.len()) - 1;
        let step = self.times[index + 1] - self.times[index];
        let at = self.pieces[index].at((clock.time - self.times[index]) / step);
        let (first, second) = (at.first / step, at.second / (step * step));
        Moment {
            position: Point3::from(at.place),
            velocity: first * clock.rate,
            acceleration: second * (clock.rate * clock.rate) + first * clock.change,
        }
    }

    /// Returns the trajectory's own time. That of a loop begins slowly: its rate is 3x² - 2x³ with
    /// x the share of the start that is over.
    fn clock(&self, time: f64) -> ClockTime {
        let end = self.duration();
        if self.run == Run::Once {
            return ClockTime { time: time.clamp(0.0, end), rate: 1.0, change: 0.0 };
        }
        let x = (time / START_S).clamp(0.0, 1.0);
        let start = START_S * x * x * x * (1.0 - x / 2.0);
        ClockTime {
            time: (start + (time - START_S).max(0.0)).rem_euclid(end),
            rate: x * x * (3.0 - 2.0 * x),
            change: 6.0 * x * (1.0 - x) / START_S,
        }
    }
}
