//! Samples of a run: the parts of its records that the figures show.

use nalgebra::Point3;
use plumb_runtime::observer::{FrameRecord, Observer};

/// Largest coordinate that is drawn, metres. One that is larger would shrink the rest to a dot.
pub(crate) const FARTHEST_M: f64 = 100.0;

/// Latest time that is drawn, seconds: 30 years.
pub(crate) const LATEST_S: f64 = 1e9;

/// Plotted part of a row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sample {
    /// Time since the run's start, seconds.
    pub(crate) time_s: f64,
    pub(crate) position: Option<Point3<f64>>,
    pub(crate) target: Option<Point3<f64>>,
    pub(crate) error_m: Option<f64>,
    /// Deviation from a path, where the ball follows one.
    pub(crate) deviation: Option<Deviation>,
}

/// Deviation of the ball from a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation {
    /// How far the ball is ahead, metres.
    pub(crate) along_m: Option<f64>,
    /// Distance across the path, metres.
    pub(crate) cross_m: Option<f64>,
}

impl HasError for Sample {
    fn error_m(&self) -> Option<f64> {
        self.error_m
    }
}

impl From<&FrameRecord> for Sample {
    fn from(record: &FrameRecord) -> Self {
        let position = record.position();
        let deviation = record.path.map(|path| Deviation {
            along_m: position.map(|position| path.along_track(position)),
            cross_m: position.map(|position| path.cross_track(position)),
        });
        let (target, error_m) = (record.target, record.error());
        Self { time_s: record.time, position, target, error_m, deviation }.shown()
    }
}

impl Sample {
    /// Returns the values that are numbers and within [`FARTHEST_M`].
    pub(crate) fn shown(self) -> Self {
        let near = |c: &f64| c.abs() <= FARTHEST_M;
        let shown = |p: &Point3<f64>| p.iter().all(near);
        Self {
            // A time that is not a number is drawn at the start.
            time_s: if self.time_s.is_nan() { 0.0 } else { self.time_s.clamp(-LATEST_S, LATEST_S) },
            position: self.position.filter(shown),
            target: self.target.filter(shown),
            error_m: self.error_m.filter(near),
            deviation: self.deviation.map(|deviation| Deviation {
                along_m: deviation.along_m.filter(near),
                cross_m: deviation.cross_m.filter(near),
            }),
        }
    }
}

/// Number of samples above which they are thinned out: 2.6 MB, ten for each point of a line.
const MOST: usize = 30_000;

/// Sample of a run.
pub(crate) trait HasError: Copy {
    /// Returns |e|, metres, where it is known.
    fn error_m(&self) -> Option<f64>;
}

/// Samples of a run. A long run keeps the one with the largest error of each group of neighbours,
/// so that a run of days takes no more memory than one of a quarter of an hour.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Samples<S> {
    kept: Vec<S>,
    /// Number of rows for each sample.
    group: u64,
    /// Number of rows in the present group, and the sample to keep of it.
    pending: (u64, Option<S>),
}

impl<S: HasError> Samples<S> {
    /// Creates an empty list.
    pub(crate) fn new() -> Self {
        Self { kept: Vec::new(), group: 1, pending: (0, None) }
    }

    /// Adds the sample of the next row.
    pub(crate) fn push(&mut self, sample: S) {
        let (rows, kept) = self.pending;
        let kept = kept.map_or(sample, |kept| farther(kept, sample));
        if rows + 1 < self.group {
            self.pending = (rows + 1, Some(kept));
            return;
        }
        self.pending = (0, None);
        self.kept.push(kept);
        if self.kept.len() == MOST {
            self.thin_out();
        }
    }

    /// Returns the samples, in the order of their rows.
    pub(crate) fn to_vec(&self) -> Vec<S> {
        self.kept.iter().copied().chain(self.pending.1).collect()
    }

    /// Keeps one sample of two.
    fn thin_out(&mut self) {
        self.kept = self.kept.chunks_exact(2).map(|pair| farther(pair[0], pair[1])).collect();
        self.group *= 2;
    }
}

/// Returns the sample with the larger error.
fn farther<S: HasError>(a: S, b: S) -> S {
    if b.error_m() > a.error_m() { b } else { a }
}

/// Observer that collects the error of a run over time, for one curve of the figure. Of a long run
/// it keeps the largest errors.
#[derive(Debug, Clone, PartialEq)]
pub struct LawCurve {
    /// Name of the curve.
    law: String,
    points: Samples<CurvePoint>,
}

/// Point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurvePoint {
    /// Time since the run's start, seconds.
    time_s: f64,
    /// |e|, metres.
    error_m: f64,
}

impl HasError for CurvePoint {
    fn error_m(&self) -> Option<f64> {
        Some(self.error_m)
    }
}

impl LawCurve {
    /// Returns a curve without points.
    pub fn new(law: String) -> Self {
        Self { law, points: Samples::new() }
    }

    /// Adds a point: seconds since the run's start, and |e| in metres.
    pub(crate) fn add(&mut self, time_s: f64, error_m: f64) {
        self.points.push(CurvePoint { time_s, error_m });
    }

    /// Returns the curve with another name.
    pub(crate) fn named(self, law: String) -> Self {
        Self { law, ..self }
    }

    /// Returns the name.
    pub(crate) fn law(&self) -> &str {
        &self.law
    }

    /// Returns the points in the order of time: seconds since the run's start, and |e| in metres.
    pub(crate) fn points(&self) -> Vec<(f64, f64)> {
        self.points.to_vec().iter().map(|point| (point.time_s, point.error_m)).collect()
    }
}

impl Observer for LawCurve {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(error) = record.error() {
            self.add(record.time, error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_run_keeps_its_order_its_ends_and_its_largest_error() {
        let mut samples = Samples::new();
        let rows = 5 * MOST as u64 + 3;
        for frame in 0..rows {
            let error_m = if frame == 100_001 { 0.5 } else { 0.001 };
            let sample = Sample {
                time_s: frame as f64,
                position: None,
                target: None,
                error_m: (frame % 7 != 0).then_some(error_m),
                deviation: None,
            };
            samples.push(sample);
            assert!(samples.kept.len() < MOST);
        }
        let kept = samples.to_vec();
        assert!(kept.len() > MOST / 2, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
        let last = kept[kept.len() - 1].time_s;
        assert!(kept[0].time_s < 8.0 && last > rows as f64 - 10.0, "{last}");
        assert!(kept.iter().any(|sample| sample.error_m == Some(0.5)));
    }

    #[test]
    fn a_short_run_keeps_every_row() {
        let mut samples = Samples::new();
        let row = |frame: u32| Sample {
            time_s: f64::from(frame),
            position: None,
            target: None,
            error_m: None,
            deviation: None,
        };
        (0..1000).map(row).for_each(|sample| samples.push(sample));
        assert_eq!(samples.to_vec(), (0..1000).map(row).collect::<Vec<_>>());
    }
}
