//! Splines: twice continuously differentiable interpolations of places.

use nalgebra::Vector3;

use crate::quintic::{End, Quintic};

/// Ends of a spline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ends {
    /// Velocity and acceleration are zero at both ends. The first and the last piece then have
    /// degree 4, the others degree 3.
    AtRest,
    /// The last place is the first one; velocity and acceleration are continuous there. It needs
    /// three intervals or more.
    Periodic,
}

/// Interpolates `places` at intervals of `steps` (one fewer than places, each above 0). Returns a
/// polynomial for each interval.
pub(crate) fn interpolate(places: &[Vector3<f64>], steps: &[f64], ends: Ends) -> Vec<Quintic> {
    let rises: Vec<_> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let intervals = Intervals { rises: &rises, steps };
    let (velocities, accelerations) = match ends {
        Ends::AtRest => intervals.at_rest(),
        Ends::Periodic => intervals.periodic(),
    };
    let end = |i: usize, h: f64| End {
        place: places[i],
        first: velocities[i] * h,
        second: accelerations[i] * (h * h),
    };
    let pieces = steps.iter().enumerate();
    pieces.map(|(i, &h)| Quintic::between(&end(i, h), &end(i + 1, h))).collect()
}

/// Intervals of a spline.
struct Intervals<'a> {
    /// Differences of the places at both ends, metres.
    rises: &'a [Vector3<f64>],
    /// Lengths in the parameter.
    steps: &'a [f64],
}

impl Intervals<'_> {
    /// Returns velocities and accelerations at all places, for ends at rest.
    fn at_rest(&self) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let last = self.steps.len();
        let inner: Vec<_> = (1..last).map(|i| self.condition(i - 1, i)).collect();
        let mut velocities = vec![Vector3::zeros()];
        velocities.extend(solve(&inner, |condition| condition.right));
        velocities.push(Vector3::zeros());
        let mut accelerations = vec![Vector3::zeros(); last + 1];
        for i in 1..last {
            accelerations[i] = self.acceleration(i, velocities[i], velocities[i + 1]);
            if i + 1 == last {
                let (h, rise) = (self.steps[i], self.rises[i]);
                accelerations[i] = (rise * 12.0 / h - velocities[i] * 6.0) / h;
            }
        }
        (velocities, accelerations)
    }

    /// Returns velocities and accelerations at all places, for a loop.
    fn periodic(&self) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let count = self.steps.len();
        let before = |i: usize| (i + count - 1) % count;
        let all: Vec<_> = (0..count).map(|i| self.cubic_condition(before(i), i)).collect();
        let mut velocities = solve_cyclic(all);
        velocities.push(velocities[0]);
        let mut accelerations: Vec<_> =
            (0..count).map(|i| self.acceleration(i, velocities[i], velocities[i + 1])).collect();
        accelerations.push(accelerations[0]);
        (velocities, accelerations)
    }

    /// Returns the acceleration at the start of a cubic interval with these velocities at its ends.
    fn acceleration(&self, i: usize, from: Vector3<f64>, to: Vector3<f64>) -> Vector3<f64> {
        let h = self.steps[i];
        (self.rises[i] * 6.0 / h - from * 4.0 - to * 2.0) / h
    }

    /// Returns the condition of a continuous acceleration between the intervals `i` and `k`. With h
    /// the steps, D the rises and m the velocities, it is for two cubic intervals
    /// m₋/h₋ + 2 m (1/h₋ + 1/h) + m₊/h = 3 (D₋/h₋² + D/h²).
    fn cubic_condition(&self, i: usize, k: usize) -> Condition {
        let (before, after) = (1.0 / self.steps[i], 1.0 / self.steps[k]);
        Condition {
            lower: before,
            diagonal: 2.0 * (before + after),
            upper: after,
            right: (self.rises[i] * (before * before) + self.rises[k] * (after * after)) * 3.0,
        }
    }

    /// Returns the same condition in a spline with ends at rest: the terms of an interval of degree
    /// 4 are 3 m/h and 6 D/h².
    fn condition(&self, i: usize, k: usize) -> Condition {
        let mut condition = self.cubic_condition(i, k);
        for end in [(i == 0).then_some(i), (k + 1 == self.steps.len()).then_some(k)] {
            let Some(end) = end else { continue };
            let inverse = 1.0 / self.steps[end];
            condition.diagonal += inverse;
            condition.right += self.rises[end] * (3.0 * inverse * inverse);
        }
        if i == 0 {
            condition.lower = 0.0;
        }
        if k + 1 == self.steps.len() {
            condition.upper = 0.0;
        }
        condition
    }
}

/// Row of a tridiagonal system of equations.
#[derive(Debug, Clone, Copy)]
struct Condition {
    lower: f64,
    diagonal: f64,
    upper: f64,
    right: Vector3<f64>,
}

/// Solves a tridiagonal system with a dominant diagonal, for these right sides (Thomas algorithm).
fn solve(rows: &[Condition], right: impl Fn(&Condition) -> Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut reduced: Vec<(f64, Vector3<f64>)> = Vec::with_capacity(rows.len());
    for row in rows {
        let (upper, value) = reduced.last().copied().unwrap_or((0.0, Vector3::zeros()));
        let pivot = row.diagonal - row.lower * upper;
        reduced.push((row.upper / pivot, (right(row) - value * row.lower) / pivot));
    }
    let mut next = Vector3::zeros();
    for (upper, value) in reduced.iter_mut().rev() {
        next = *value - next * *upper;
        *value = next;
    }
    reduced.into_iter().map(|(_, value)| value).collect()
}

/// Solves a tridiagonal system in which the first row's lower element belongs to the last unknown,
/// and the last row's upper element to the first (Sherman and Morrison's formula).
fn solve_cyclic(mut rows: Vec<Condition>) -> Vec<Vector3<f64>> {
    let last = rows.len() - 1;
    let (corner_first, corner_last) = (rows[0].lower, rows[last].upper);
    let pivot = -rows[0].diagonal;
    rows[0].diagonal -= pivot;
    rows[last].diagonal -= corner_last * corner_first / pivot;
    let plain = solve(&rows, |row| row.right);
    // The correction has the right side (pivot, 0, ..., 0, corner).
    for row in &mut rows {
        row.right = Vector3::zeros();
    }
    rows[0].right = Vector3::repeat(pivot);
    rows[last].right = Vector3::repeat(corner_last);
    let unit = solve(&rows, |row| row.right);
    let share = corner_first / pivot;
    let factor = (plain[0] + plain[last] * share) / (1.0 + unit[0].x + unit[last].x * share);
    plain.iter().zip(&unit).map(|(value, unit)| value - factor * unit.x).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that velocity and acceleration are continuous at the inner places.
    fn assert_smooth(pieces: &[Quintic], steps: &[f64]) {
        for (i, pair) in pieces.windows(2).enumerate() {
            assert_joined(&pair[0], steps[i], &pair[1], steps[i + 1]);
        }
    }

    fn assert_joined(before: &Quintic, h: f64, after: &Quintic, k: f64) {
        let (end, begin) = (before.at(1.0), after.at(0.0));
        assert!((end.place - begin.place).norm() < 1e-9);
        assert!((end.first / h - begin.first / k).norm() < 1e-9);
        assert!((end.second / (h * h) - begin.second / (k * k)).norm() < 1e-9);
    }

    fn places(count: usize) -> Vec<Vector3<f64>> {
        let place = |i: usize| {
            let t = i as f64;
            Vector3::new((1.3 * t).sin(), (0.7 * t).cos(), (2.1 * t).sin() * 0.3)
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn a_spline_with_ends_at_rest_is_smooth() {
        let steps = [0.7, 0.4, 1.1, 0.2, 0.9];
        for count in 1..=steps.len() {
            let (places, steps) = (places(count + 1), &steps[..count]);
            let pieces = interpolate(&places, steps, Ends::AtRest);
            assert_smooth(&pieces, steps);
            let (begin, end) = (pieces[0].at(0.0), pieces[count - 1].at(1.0));
            for it in [begin.first, begin.second, end.first, end.second] {
                assert!(it.norm() < 1e-9);
            }
            for (piece, place) in pieces.iter().zip(&places) {
                assert!((piece.at(0.0).place - place).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn the_seam_of_a_periodic_spline_is_smooth() {
        let steps = [0.7, 0.4, 1.1, 0.2, 0.9];
        for count in 3..=steps.len() {
            let mut places = places(count);
            places.push(places[0]);
            let steps = &steps[..count];
            let pieces = interpolate(&places, steps, Ends::Periodic);
            assert_smooth(&pieces, steps);
            assert_joined(&pieces[count - 1], steps[count - 1], &pieces[0], steps[0]);
        }
    }
}
