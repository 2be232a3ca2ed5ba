//! Places, as a file gives them.

use nalgebra::Point3;

use crate::trajectory::{MotionLimits, PathError, Run, Sample, Trajectory, Waypoints};

/// What the ball does at the places of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It goes through them without a stop.
    Path,
    /// It is at each at its time.
    Timed,
    /// It stops at each.
    Stops,
}

/// What the places of a file are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// x, y, z in the rig frame, metres.
    Metres,
    /// Column and row of the picture, in y and z; x is 0.
    Pixels,
}

/// Contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Unit of the places.
    pub unit: Unit,
    /// What the ball does.
    pub kind: Kind,
    /// The places, at least one.
    pub places: Vec<Place>,
    /// Speed from each place to the next, m/s, infinite where the file has none; empty for a table.
    pub speeds: Vec<f64>,
}

impl Places {
    /// Returns the trajectory along the places: through all of them at their times, or along lines
    /// between them that keep `limits`, with corners rounded by at most `tolerance`, metres.
    ///
    /// # Errors
    /// Where there are too few places, or the path takes too long.
    pub fn trajectory(
        &self,
        limits: &MotionLimits,
        tolerance: f64,
        run: Run,
    ) -> Result<Trajectory, PathError> {
        if self.kind == Kind::Timed {
            let sample = |it: &Place| Sample { time: it.time_s, position: it.position };
            let samples: Vec<_> = self.places.iter().map(sample).collect();
            return Trajectory::through_samples(&samples, run);
        }
        let places = self.places.iter().map(|place| place.position).collect();
        let waypoints = Waypoints { places, speeds: self.speeds.clone(), tolerance };
        Trajectory::through(&waypoints, limits, run)
    }
}

/// Place of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Place, in the unit of the file.
    pub position: Point3<f64>,
    /// Time, seconds; 0 in a file without times.
    pub time_s: f64,
    /// Time for which the ball stays, seconds.
    pub dwell_s: f64,
    /// Distance within which the place counts as reached, metres.
    pub tolerance_m: Option<f64>,
}

impl Place {
    /// Returns the place at a line, without times.
    pub(crate) fn new(line: usize, position: Point3<f64>) -> Self {
        Self { line, position, time_s: 0.0, dwell_s: 0.0, tolerance_m: None }
    }
}
