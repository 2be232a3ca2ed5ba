//! Rows of a run as the figures need them, in bounded memory.

/// Number of samples above which they are thinned out: 2.6 MB, ten for each point of a line.
const MOST: usize = 30_000;

/// Sample of a run.
pub(in crate::run_log) trait HasError: Copy {
    /// Returns |e|, metres, where it is known.
    fn error_m(&self) -> Option<f64>;
}

/// Samples of a run. A long run keeps the one with the largest error of each group of neighbours,
/// so that a run of days takes no more memory than one of a quarter of an hour.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::run_log) struct Samples<S> {
    kept: Vec<S>,
    /// Number of rows for each sample.
    group: u64,
    /// Number of rows in the present group, and the sample to keep of it.
    pending: (u64, Option<S>),
}

impl<S: HasError> Samples<S> {
    /// Creates an empty list.
    pub(in crate::run_log) fn new() -> Self {
        Self { kept: Vec::new(), group: 1, pending: (0, None) }
    }

    /// Adds the sample of the next row.
    pub(in crate::run_log) fn push(&mut self, sample: S) {
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
    pub(in crate::run_log) fn to_vec(&self) -> Vec<S> {
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

#[cfg(test)]
mod tests {
    use super::super::Sample;
    use super::*;

    #[test]
    fn a_long_run_keeps_its_order_its_ends_and_its_largest_error() {
        let mut samples = Samples::new();
        let rows = 5 * MOST as u64 + 3;
        for frame in 0..rows {
            let error_m = if frame == 100_001 { 0.5 } else { 0.001 };
            let sample = Sample {
                frame: frame as f64,
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
        assert!(kept.windows(2).all(|pair| pair[0].frame < pair[1].frame));
        let last = kept[kept.len() - 1].frame;
        assert!(kept[0].frame < 8.0 && last > rows as f64 - 10.0, "{last}");
        assert!(kept.iter().any(|sample| sample.error_m == Some(0.5)));
    }

    #[test]
    fn a_short_run_keeps_every_row() {
        let mut samples = Samples::new();
        let row = |frame: u32| Sample {
            frame: f64::from(frame),
            position: None,
            target: None,
            error_m: None,
            deviation: None,
        };
        (0..1000).map(row).for_each(|sample| samples.push(sample));
        assert_eq!(samples.to_vec(), (0..1000).map(row).collect::<Vec<_>>());
    }
}
