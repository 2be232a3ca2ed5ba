//! Place of the ball at rest, from several pictures.

use nalgebra::{Point3, Vector3};

/// Standard deviation of a normal distribution for a median absolute deviation of 1.
const SD_PER_MAD: f64 = 1.4826;

/// Standard deviation of a median of n values for a standard deviation of 1 of each, times √n.
const MEDIAN_SD: f64 = 1.2533;

/// Place of the ball from several pictures. Single outliers have no effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Median of the positions, metres.
    pub median: Point3<f64>,
    /// Scatter of a single position: the largest standard deviation of the axes, metres.
    pub scatter: f64,
    /// Standard deviation of the median along the axis with the largest, metres.
    pub sd: f64,
}

impl Place {
    /// Returns the place from these positions; `None` without any.
    pub(super) fn of(positions: &[Point3<f64>]) -> Option<Self> {
        let axis = |k: usize| positions.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let axes = [axis(0), axis(1), axis(2)];
        let [x, y, z] = [median(&axes[0])?, median(&axes[1])?, median(&axes[2])?];
        let centre = [x, y, z];
        let scatter = axes.iter().zip(centre).filter_map(|(values, centre)| {
            let distances: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
            median(&distances)
        });
        let scatter = SD_PER_MAD * scatter.fold(0.0, f64::max);
        let sd = MEDIAN_SD * scatter / (positions.len() as f64).sqrt();
        Some(Self { median: Point3::from(centre), scatter, sd })
    }

    /// Returns the displacement since `before`, metres.
    pub(super) fn since(&self, before: &Self) -> Vector3<f64> {
        self.median - before.median
    }
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    if sorted.len() % 2 == 1 { Some(upper) } else { Some((upper + sorted[middle - 1]) / 2.0) }
}
