//! Geometry of a rig that a filter has estimated, for the next run.

use heapless::Vec;
use plumb_protocol::dimension::{AXES, MOTORS};
use plumb_protocol::prior::RigPrior;
use serde::{Deserialize, Serialize};

use super::filter::Filter;
use super::geometry::{DELAY, DELAY_SD, N, STEP, length};
use super::observation::Observation;
use crate::vector::per_motor;

/// Entries of a filter's state that a later run can use: all but the ball.
const KEPT: usize = N - AXES;
/// Pairs of these entries.
const PAIRS: usize = KEPT * (KEPT - 1) / 2;
/// Version of the bytes of a [`KnownRig`].
const LAYOUT: u8 = 2;
/// Size of a number, bytes.
const NUMBER: usize = size_of::<f32>();
/// Size of a correlation, bytes.
const CORRELATION: usize = size_of::<i16>();
/// Place of the first correlation.
const CORRELATIONS: usize = 1 + 2 * KEPT * NUMBER;
/// Number of the bytes.
const BYTES: usize = CORRELATIONS + PAIRS * CORRELATION;
/// Correlation of 1. The rounding is far below the doubt that is added at the next run.
const FULL: f32 = i16::MAX as f32;

/// Geometry of a rig as a filter has estimated it, with its covariance, in 199 bytes: they fit a
/// page of the flash.
///
/// The bytes are a version; the positions of motors A, B, C (mm), ln of the cable of a step in mm,
/// and the delay (frame times); the standard deviations of these; and the correlations of each with
/// those before it, over 32 767. Numbers begin with their least byte.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownRig(Vec<u8, BYTES>);

/// Largest doubt of the ball's movement for a step of a motor, as a share of the movement, with
/// which a rig counts as known. The guesses begin with 0.5 to 0.6, and after a run to one target
/// 95 % of 200 rigs have at most 0.33.
const MAX_DOUBT: f32 = 0.4;
/// Standard deviation that is added to a motor's coordinate, mm: the motors may have been touched,
/// and the camera calibrated anew.
const MOVED_MM: f32 = 15.0;
/// Standard deviation that is added to the logarithm of the cable of a step: the pulleys may be
/// others. With 0.02 such a rig is slacker, and one that is not changed no quicker
/// (docs/understand/results.md).
const REWOUND: f32 = 0.12;

impl KnownRig {
    /// Returns the rig of a tape measure: of its steps the mean counts, and of the delay nothing is
    /// known.
    #[cold]
    pub(crate) fn measured(prior: &RigPrior) -> Self {
        let cables = prior.cable_per_step.iter();
        let cable = cables.map(|nm| *nm as f32 * 1e-6).sum::<f32>() / MOTORS as f32;
        let mut state = [0.0; KEPT];
        let places = prior.motors.iter().flat_map(|motor| motor.micrometres());
        for (coordinate, um) in state.iter_mut().zip(places) {
            *coordinate = um as f32 * 1e-3;
        }
        state[STEP - AXES] = libm::logf(cable);
        let mut deviations = [prior.deviation.0 as f32 * 1e-3; KEPT];
        deviations[STEP - AXES] = f32::from(prior.cable_deviation) / 1024.0;
        deviations[DELAY - AXES] = DELAY_SD;
        Self::from_parts(&state, &deviations, [0; PAIRS])
    }

    /// Returns the geometry of `filter`; `None` while it does not know how the ball moves.
    #[cold]
    pub(super) fn of(filter: &Filter) -> Option<Self> {
        if !filter.is_valid() || doubt(filter) > MAX_DOUBT {
            return None;
        }
        let (x, p) = filter.state();
        let deviations = core::array::from_fn(|at| {
            let i = AXES + at;
            let added = match i {
                STEP => REWOUND,
                i if i < STEP => MOVED_MM,
                _ => 0.0,
            };
            libm::sqrtf(p[i][i] + added * added)
        });
        let mut correlations = [0; PAIRS];
        for (correlation, (i, k)) in correlations.iter_mut().zip(pairs()) {
            let full = (deviations[i - AXES] * deviations[k - AXES]).max(f32::MIN_POSITIVE);
            // The cast saturates.
            *correlation = (FULL * p[i][k] / full) as i16;
        }
        Some(Self::from_parts(&x[AXES..], &deviations, correlations))
    }

    /// Returns the bytes of these entries of a state, their standard deviations, and the
    /// correlations of [`pairs`].
    #[cold]
    fn from_parts(state: &[f32], deviations: &[f32; KEPT], correlations: [i16; PAIRS]) -> Self {
        let mut rig = Self(Vec::new());
        rig.push([LAYOUT]);
        for number in state.iter().chain(deviations) {
            rig.push(number.to_le_bytes());
        }
        for correlation in correlations {
            rig.push(correlation.to_le_bytes());
        }
        rig
    }

    /// Returns whether the bytes are of this version, with numbers as a filter has them.
    #[cold]
    pub(crate) fn is_usable(&self) -> bool {
        self.0.len() == BYTES
            && self.0[0] == LAYOUT
            && (0..2 * KEPT).all(|i| self.number(i).is_finite())
    }

    /// Returns state and covariance of a filter that begins with this geometry and the ball of
    /// `seen`.
    #[cold]
    pub(super) fn begin(&self, seen: &Observation) -> ([f32; N], [[f32; N]; N]) {
        let (mut x, mut p) = ([0.0; N], [[0.0; N]; N]);
        for i in 0..AXES {
            x[i] = seen.ball[i];
            p[i][i] = seen.variances[i];
        }
        let deviation = |i: usize| self.number(KEPT + i - AXES);
        for i in AXES..N {
            x[i] = self.number(i - AXES);
            p[i][i] = deviation(i) * deviation(i);
        }
        for (place, (i, k)) in (CORRELATIONS..).step_by(CORRELATION).zip(pairs()) {
            let correlation = f32::from(i16::from_le_bytes(self.at(place))) / FULL;
            p[i][k] = correlation * deviation(i) * deviation(k);
            p[k][i] = p[i][k];
        }
        (x, p)
    }

    /// Appends bytes. There is room for all.
    fn push<const LENGTH: usize>(&mut self, bytes: [u8; LENGTH]) {
        let _ = self.0.extend_from_slice(&bytes);
    }

    /// Returns the bytes from `place` on; zeros behind the end.
    #[inline(never)]
    #[cold]
    fn at<const LENGTH: usize>(&self, place: usize) -> [u8; LENGTH] {
        let bytes = self.0.get(place..place + LENGTH);
        bytes.and_then(|bytes| bytes.try_into().ok()).unwrap_or([0; LENGTH])
    }

    /// Returns a number: of the state, or of the standard deviations behind it.
    fn number(&self, index: usize) -> f32 {
        f32::from_le_bytes(self.at(1 + NUMBER * index))
    }
}

/// Returns the pairs of entries of a filter's state in the order of their correlations, the later
/// entry first.
fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (AXES + 1..N).flat_map(|i| (AXES..i).map(move |k| (i, k)))
}

/// Returns the standard deviation of the ball's movement for a step of a motor over the movement:
/// that of the motor of which least is known.
fn doubt(filter: &Filter) -> f32 {
    let j = filter.jacobian();
    let doubts = per_motor(|motor| {
        let step = per_motor(|k| if k == motor { 1.0 } else { 0.0 });
        let covariance = filter.covariance(step);
        let variance = covariance[0][0] + covariance[1][1] + covariance[2][2];
        let moves = length(j.map(|row| row[motor]));
        libm::sqrtf(variance.max(0.0)) / moves.max(1e-6)
    });
    doubts.into_iter().fold(0.0, f32::max)
}
