//! The slack-free reference: the fastest plan with a perfect model that keeps all cables taut.

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{ElasticParameters, GRAVITY_M_S2, Task, lowest_point};
use plumb_protocol::{MOTORS, PerMotor};
use plumb_sim::limits::RigLimits;

use super::oracle::{Path, STEP_S};

/// Number of grid intervals along the path.
const GRID: usize = 400;
/// Least tension of each cable, as a fraction of its static tension.
const MIN_TENSION: f64 = 0.5;
/// Least rate of progress, 1/s. The rate is 0 at both ends, where integration would stop.
const MIN_PROGRESS: f64 = 1e-3;
/// Greatest length of a plan, milliseconds.
const MAX_ROWS: usize = 600_000;

/// Returns the fastest plan along the straight path in cable lengths that keeps half of each
/// cable's static tension (rigid cables, full knowledge), through a running mean of `mean_s`
/// seconds. Elastic cables are shortened by their elongation at rest. Rows are motor positions in
/// full steps, one a millisecond.
pub(crate) fn slack_free(
    task: &Task,
    limits: &RigLimits,
    mean_s: f64,
    elasticity: Option<ElasticParameters>,
) -> Vec<PerMotor<f64>> {
    let path = Path::new(task);
    let fractions = progress(&fastest(task, &path, limits));
    let window = ((mean_s / STEP_S) as usize).max(1);
    let mean = |k: usize| -> f64 {
        (0..window).map(|j| fractions[k.saturating_sub(j).min(fractions.len() - 1)]).sum::<f64>()
            / window as f64
    };
    let initial = elongation_steps(task, &path, 0.0, elasticity);
    (0..fractions.len() + window)
        .map(|k| {
            let fraction = mean(k);
            let elongation = elongation_steps(task, &path, fraction, elasticity);
            std::array::from_fn(|i| path.steps[i] * fraction - (elongation[i] - initial[i]))
        })
        .collect()
}

/// Returns the fraction of the path covered after each millisecond, from the `squares` of the rate
/// of progress (1/s²) at the grid's points.
fn progress(squares: &[f64]) -> Vec<f64> {
    let mut fractions = vec![0.0];
    let (mut fraction, mut cell) = (0.0, 0);
    while cell < GRID && fractions.len() < MAX_ROWS {
        let within = fraction * GRID as f64 - cell as f64;
        let square = squares[cell] + (squares[cell + 1] - squares[cell]) * within.clamp(0.0, 1.0);
        fraction += STEP_S * square.sqrt().max(MIN_PROGRESS);
        cell = ((fraction * GRID as f64) as usize).min(GRID);
        fractions.push(fraction.min(1.0));
    }
    fractions
}

/// Returns the elongation of each cable at rest at a fraction of the path, in steps; 0 for rigid
/// cables.
fn elongation_steps(
    task: &Task,
    path: &Path,
    fraction: f64,
    elasticity: Option<ElasticParameters>,
) -> PerMotor<f64> {
    let at_rest = || {
        let parameters = elasticity?;
        let ball = lowest_point(&task.geometry, path.lengths(fraction)).ok()?.ball;
        let tensions = task.geometry.tensions_per_weight(&ball)?;
        let weight = parameters.mass_kg * GRAVITY_M_S2;
        Some(std::array::from_fn(|i| {
            tensions[i] * weight / parameters.stiffness_n_m[i] / path.step_m[i]
        }))
    };
    at_rest().unwrap_or_default()
}

/// Returns the squares of the rate of progress (1/s²) at the grid's points, from a forward and a
/// backward pass through the limits.
fn fastest(task: &Task, path: &Path, limits: &RigLimits) -> Vec<f64> {
    let length = path.longest().max(1e-9);
    let ball = |k: f64| {
        lowest_point(&task.geometry, path.lengths(k / GRID as f64))
            .map_or(task.start, |hang| hang.ball)
    };
    let h = 1.0 / GRID as f64;
    let top = (limits.rate / length).powi(2);
    let bound = |k: usize, square: f64| -> (f64, f64) {
        let x = (k as f64).clamp(1.0, GRID as f64 - 1.0);
        let (before, here, after) = (ball(x - 1.0), ball(x), ball(x + 1.0));
        let (slope, curvature) =
            ((after - before) / (2.0 * h), ((after - here) - (here - before)) / (h * h));
        accelerations(task, here, slope, curvature * square, limits.acceleration / length)
    };
    let mut squares = vec![top; GRID + 1];
    (squares[0], squares[GRID]) = (0.0, 0.0);
    for k in 0..GRID {
        let most = bound(k, squares[k]).1.max(0.0);
        squares[k + 1] = squares[k + 1].min(squares[k] + 2.0 * h * most);
    }
    for k in (0..GRID).rev() {
        let least = bound(k + 1, squares[k + 1]).0.min(0.0);
        squares[k] = squares[k].min(squares[k + 1] - 2.0 * h * least);
    }
    squares
}

/// Returns the least and greatest acceleration of progress (1/s²) with which each cable keeps its
/// least tension. `slope` and `drift` are the ball's acceleration (m/s²) for a unit of that and
/// for none; `limit` is the motors'.
fn accelerations(
    task: &Task,
    ball: Point3<f64>,
    slope: Vector3<f64>,
    drift: Vector3<f64>,
    limit: f64,
) -> (f64, f64) {
    let Some(j) = task.geometry.jacobian(&ball) else { return (0.0, 0.0) };
    let (mut least, mut most) = (-limit, limit);
    for k in 0..MOTORS {
        // T/m = -J'(g ẑ + a) >= MIN_TENSION · (-J' g ẑ)
        // <=>  J_k·a <= (1 - MIN_TENSION) g |J_zk|
        let column = j.column(k);
        let room = (1.0 - MIN_TENSION) * GRAVITY_M_S2 * column[2].abs() - column.dot(&drift);
        let slope = column.dot(&slope);
        if slope > 1e-12 {
            most = most.min(room / slope);
        } else if slope < -1e-12 {
            least = least.max(room / slope);
        }
    }
    (least, most)
}
