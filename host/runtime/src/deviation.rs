//! Deviations of the ball from a path.

use std::fmt;

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use crate::rounding::{millimetres, round};

/// Speed below which a path rests, m/s: the least that the board can be sent.
const LEAST_SPEED: f64 = 1e-6;

/// Point of a path at the time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Time of the path, seconds.
    pub time: f64,
    /// Speed of the path's time: 1 where the motors and the ball keep up.
    pub pace: f64,
    /// Place, metres in the rig frame.
    pub position: Point3<f64>,
    /// Velocity of the path, m/s.
    pub velocity: Vector3<f64>,
}

impl PathPoint {
    /// Returns how far a place is ahead of the point along the path's direction, metres; 0 where
    /// the path rests.
    pub fn along_track(&self, place: Point3<f64>) -> f64 {
        self.direction().dot(&(place - self.position))
    }

    /// Returns the distance of a place from the point across the path's direction, metres.
    pub fn cross_track(&self, place: Point3<f64>) -> f64 {
        let error = place - self.position;
        (error - self.direction() * self.direction().dot(&error)).norm()
    }

    /// Returns the unit vector of the velocity; zero where the path rests.
    fn direction(&self) -> Vector3<f64> {
        self.velocity.try_normalize(LEAST_SPEED).unwrap_or_default()
    }
}

/// Width of a class of the histogram, metres.
const CLASS_M: f64 = 2e-5;
/// Number of classes; the last one also counts everything above it.
const CLASSES: usize = 5000;

/// Distances of a run in bounded memory.
#[derive(Debug, Clone)]
struct Distances {
    count: u64,
    sum_of_squares: f64,
    largest: f64,
    histogram: Vec<u32>,
}

/// Distances: root mean square, 99th percentile and largest one, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Root of the mean square.
    pub rms_mm: f64,
    /// 99 % of the distances are at most this, to 0.02 mm; of distances above 100 mm the largest.
    pub p99_mm: f64,
    /// Largest distance.
    pub max_mm: f64,
}

/// Distances of the ball from a path or a target that moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spreads {
    /// Number of pictures with the ball.
    pub frames: u64,
    /// Distance from where the path or the target is at the time.
    pub error: Spread,
    /// Distance across the direction of the motion.
    pub cross_track: Spread,
    /// Distance along the direction of the motion.
    pub along_track: Spread,
}

/// How the ball followed a path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathSummary {
    /// Time of the whole path, seconds; left out for a loop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Time of the path that was reached, seconds.
    pub path_time_s: f64,
    /// Time for it, seconds.
    pub time_s: f64,
    /// Share of the path's speed that was kept: path time over time.
    pub speed_kept: f64,
    /// Distances from the path while the board followed it.
    #[serde(flatten)]
    pub spreads: Spreads,
}

/// As a line for people.
impl fmt::Display for PathSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Spread { rms_mm, p99_mm, max_mm } = self.spreads.error;
        write!(
            f,
            "path: {:.1}{} s followed in {:.1} s, {:.0} % of its speed; distance from it \
             {rms_mm:.1} mm rms, at most {p99_mm:.1} mm in 99 % of {} pictures, and at most \
             {max_mm:.1} mm",
            self.path_time_s,
            self.duration_s.map(|whole| format!(" of {whole:.1}")).unwrap_or_default(),
            self.time_s,
            // The start is known to a picture.
            (self.speed_kept * 100.0).min(100.0),
            self.spreads.frames
        )
    }
}

/// Deviations of a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Deviations {
    error: Distances,
    cross_track: Distances,
    along_track: Distances,
}

impl Default for Distances {
    fn default() -> Self {
        Self { count: 0, sum_of_squares: 0.0, largest: 0.0, histogram: vec![0; CLASSES] }
    }
}

impl Distances {
    fn add(&mut self, distance: f64) {
        self.count += 1;
        self.sum_of_squares += distance * distance;
        self.largest = self.largest.max(distance);
        // The cast saturates.
        let class = ((distance / CLASS_M) as usize).min(CLASSES - 1);
        self.histogram[class] = self.histogram[class].saturating_add(1);
    }

    fn spread(&self) -> Spread {
        let mut left = self.count - self.count / 100;
        let class = self.histogram.iter().position(|&count| {
            left = left.saturating_sub(u64::from(count));
            left == 0
        });
        let p99 = match class {
            Some(class) if class + 1 < CLASSES => CLASS_M * (class + 1) as f64,
            _ => self.largest,
        };
        Spread {
            rms_mm: millimetres((self.sum_of_squares / self.count.max(1) as f64).sqrt()),
            p99_mm: millimetres(p99.min(self.largest)),
            max_mm: millimetres(self.largest),
        }
    }
}

impl Deviations {
    /// Adds the deviation of a ball at `position`, metres, from the path.
    pub(crate) fn add(&mut self, path: &PathPoint, position: Point3<f64>) {
        self.error.add((position - path.position).norm());
        self.cross_track.add(path.cross_track(position));
        self.along_track.add(path.along_track(position).abs());
    }

    /// Returns the summary of a path that reached `path_time` in `time`, of the whole `duration`
    /// (`None` for a loop); seconds.
    pub(crate) fn summary(&self, path_time: f64, time: f64, duration: Option<f64>) -> PathSummary {
        let kept = if time > 0.0 { path_time / time } else { 0.0 };
        PathSummary {
            duration_s: duration.map(|duration| round(duration, 1e3)),
            path_time_s: round(path_time, 1e3),
            time_s: round(time, 1e3),
            speed_kept: round(kept, 1e3),
            spreads: self.spreads(),
        }
    }

    /// Returns the distances.
    pub(crate) fn spreads(&self) -> Spreads {
        Spreads {
            frames: self.error.count,
            error: self.error.spread(),
            cross_track: self.cross_track.spread(),
            along_track: self.along_track.spread(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_known_distances_is_right() {
        let mut distances = Distances::default();
        (1..=1000).for_each(|i| distances.add(f64::from(i) * 1e-5));
        let spread = distances.spread();
        assert!((spread.p99_mm - 9.9).abs() < 0.021, "{spread:?}");
        assert_eq!(spread.max_mm, 10.0);
        assert!((spread.rms_mm - 5.778).abs() < 0.001, "{spread:?}");
        distances.add(1.0);
        assert_eq!(distances.spread().max_mm, 1000.0);
        assert_eq!(Distances::default().spread().rms_mm, 0.0);
    }
}
