//! Irradiance smoothed within each surface.

use std::ops::Range;

/// What smoothing needs of the pixels, each value in an array of its own, so that the compiler
/// smooths several columns at once.
pub(super) struct Light {
    /// Number of the surface.
    pub(super) surface: Vec<u32>,
    pub(super) normal: [Vec<f32>; 3],
    /// Irradiance, linear.
    pub(super) arriving: [Vec<f32>; 3],
}

/// Largest distance of neighbours that are smoothed, pixels along each axis.
const REACH: usize = 4;

impl Light {
    /// Returns the mean irradiance of the neighbours on the same surface, for each pixel of `row`.
    pub(super) fn smoothed(&self, row: usize, (width, height): (usize, usize)) -> Vec<[f32; 3]> {
        let zeros = || vec![0.0; width];
        let mut sums = Sums { counts: zeros(), arriving: [zeros(), zeros(), zeros()] };
        for other in row.saturating_sub(REACH)..(row + REACH + 1).min(height) {
            for shift in 0..=2 * REACH {
                // Of column `own`, the neighbour in column `own + shift - REACH`.
                let first = REACH.saturating_sub(shift);
                let count = width.saturating_sub(shift.abs_diff(REACH));
                let (own, other) = (row * width + first, other * width + first + shift - REACH);
                self.add(own, other, &mut sums, first..first + count);
            }
        }
        let mean = |column: usize| {
            let count = f32::max(sums.counts[column], 1.0);
            sums.arriving.each_ref().map(|it| it[column] / count)
        };
        (0..width).map(mean).collect()
    }

    /// Adds to the sums of `columns` the irradiance of the pixels from `other` on, where the pixels
    /// from `own` on are on the same surface with similar normals.
    fn add(&self, own: usize, other: usize, sums: &mut Sums, columns: Range<usize>) {
        // Slices of one length, of which the compiler sees that it is the same.
        let count = columns.len();
        let [ax, ay, az] = self.normal.each_ref().map(|it| &it[own..][..count]);
        let [bx, by, bz] = self.normal.each_ref().map(|it| &it[other..][..count]);
        let [a0, a1, a2] = self.arriving.each_ref().map(|it| &it[other..][..count]);
        let [s0, s1, s2] = sums.arriving.each_mut().map(|it| &mut it[columns.start..][..count]);
        let (a, b) = (&self.surface[own..][..count], &self.surface[other..][..count]);
        let counts = &mut sums.counts[columns.start..][..count];
        for k in 0..count {
            let dot = ax[k] * bx[k] + ay[k] * by[k] + az[k] * bz[k];
            let is_like = (a[k] == b[k]) & (dot > 0.93);
            counts[k] += if is_like { 1.0 } else { 0.0 };
            s0[k] += if is_like { a0[k] } else { 0.0 };
            s1[k] += if is_like { a1[k] } else { 0.0 };
            s2[k] += if is_like { a2[k] } else { 0.0 };
        }
    }
}

/// Sums over neighbours, for each pixel of a row.
struct Sums {
    counts: Vec<f32>,
    arriving: [Vec<f32>; 3],
}
