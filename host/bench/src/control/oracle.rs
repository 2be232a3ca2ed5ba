//! What there is to be measured against: a robot that knows itself, and one that besides keeps its
//! cables taut.

use nalgebra::Vector3;
use plumb_emulator::rig::{ElasticParameters, RigError, Task, lowest_point};

use plumb_sim::limits::Limits;

/// Time resolution, seconds.
const STEP_S: f64 = 1e-3;

/// A straight way in the space of cable lengths, and how far along it the ball is when.
struct Way {
    start_m: [f64; 3],
    /// Steps of each motor from start to target.
    steps: [f64; 3],
    step_m: [f64; 3],
}

impl Way {
    fn new(task: &Task) -> Self {
        let (start_m, end) = (
            task.geometry.cable_lengths_m(&task.start),
            task.geometry.cable_lengths_m(&task.target),
        );
        let step_m = task.geometry.step_lengths_m();
        Self { start_m, steps: [0, 1, 2].map(|i| (end[i] - start_m[i]) / step_m[i]), step_m }
    }

    /// The most that one motor turns, steps.
    fn longest(&self) -> f64 {
        self.steps.iter().fold(0.0, |most, s| s.abs().max(most))
    }

    fn lengths(&self, part: f64) -> [f64; 3] {
        [0, 1, 2].map(|i| self.start_m[i] + part * self.steps[i] * self.step_m[i])
    }
}

/// The part of a way of `length` steps that is behind a trapezoid of rates after `t` seconds.
fn trapezoid(length: f64, limits: &Limits, t: f64) -> f64 {
    let ramp = limits.rate / limits.acceleration;
    let (ramp, top) = if length >= limits.rate * ramp {
        (ramp, limits.rate)
    } else {
        let short = (length / limits.acceleration).sqrt();
        (short, short * limits.acceleration)
    };
    let end = length / top + ramp;
    let gone = if t >= end {
        length
    } else if t > end - ramp {
        length - 0.5 * limits.acceleration * (end - t).powi(2)
    } else if t > ramp {
        top * (t - 0.5 * ramp)
    } else {
        0.5 * limits.acceleration * t * t
    };
    gone / length
}

/// The time to within `threshold_m` of the target with a perfect model: all motors in step, as fast
/// as their limits allow, on rigid cables; seconds.
///
/// # Errors
/// Where the task's rig cannot hold its ball on the way.
pub(crate) fn time_s(task: &Task, limits: &Limits, threshold_m: f64) -> Result<f64, RigError> {
    let way = Way::new(task);
    let length = way.longest();
    let mut t = 0.0;
    loop {
        let part = if length > 0.0 { trapezoid(length, limits, t) } else { 1.0 };
        let ball = lowest_point(&task.geometry, way.lengths(part))?.ball;
        if (ball - task.target).norm() <= threshold_m || part >= 1.0 {
            return Ok(t.max(STEP_S));
        }
        t += STEP_S;
    }
}

/// The oracle's plan: motor positions, full steps, one a millisecond.
pub(crate) fn trapezoids(task: &Task, limits: &Limits) -> Vec<[f64; 3]> {
    let way = Way::new(task);
    let length = way.longest();
    let parts = (0u32..).map(|k| match length {
        0.0 => 1.0,
        _ => trapezoid(length, limits, f64::from(k) * STEP_S),
    });
    let mut rows: Vec<_> =
        parts.take_while(|part| *part < 1.0).map(|part| way.steps.map(|s| s * part)).collect();
    rows.push(way.steps);
    rows
}

/// Points along the way at which the slack-free plan is made.
const GRID: usize = 400;

/// Of the static tension, what each cable keeps.
const TENSION_KEPT: f64 = 0.5;

/// Gravity, m/s².
const G: f64 = plumb_emulator::rig::GRAVITY_M_S2;

/// The slack-free reference: the fastest plan along the straight way in cable lengths such that
/// each cable keeps half of its static tension (rigid cables, full knowledge), through a running
/// mean; elastic cables are reeled in by what they stretch at rest. Motor positions, full steps,
/// one a millisecond.
pub(crate) fn slack_free(
    task: &Task,
    limits: &Limits,
    mean_s: f64,
    elasticity: Option<ElasticParameters>,
) -> Vec<[f64; 3]> {
    let way = Way::new(task);
    let speeds = fastest(task, &way, limits);
    let mut parts = vec![0.0];
    let (mut part, mut cell) = (0.0, 0);
    while cell < GRID && parts.len() < 600_000 {
        let at = part * GRID as f64 - cell as f64;
        let square = speeds[cell] + (speeds[cell + 1] - speeds[cell]) * at.clamp(0.0, 1.0);
        // Where it starts and ends the speed is 0 and would stay so: at least what is due after a
        // millisecond.
        part += STEP_S * square.sqrt().max(1e-3);
        cell = ((part * GRID as f64) as usize).min(GRID);
        parts.push(part.min(1.0));
    }
    let window = ((mean_s / STEP_S) as usize).max(1);
    let mean = |k: usize| -> f64 {
        (0..window).map(|j| parts[k.saturating_sub(j).min(parts.len() - 1)]).sum::<f64>()
            / window as f64
    };
    let rest = stretch_steps(task, &way, 0.0, elasticity);
    (0..parts.len() + window)
        .map(|k| {
            let part = mean(k);
            let stretch = stretch_steps(task, &way, part, elasticity);
            [0, 1, 2].map(|i| way.steps[i] * part - (stretch[i] - rest[i]))
        })
        .collect()
}

/// How far the cables are stretched at rest, in steps.
fn stretch_steps(
    task: &Task,
    way: &Way,
    part: f64,
    elasticity: Option<ElasticParameters>,
) -> [f64; 3] {
    let at_rest = || {
        let parameters = elasticity?;
        let ball = lowest_point(&task.geometry, way.lengths(part)).ok()?.ball;
        let tensions = task.geometry.tensions_per_weight(&ball)?;
        let weight = parameters.mass_kg * G;
        Some([0, 1, 2].map(|i| tensions[i] * weight / parameters.stiffness_n_m[i] / way.step_m[i]))
    };
    at_rest().unwrap_or_default()
}

/// Squares of the way's rate of progress (1/s²) at the grid's points: forwards and backwards
/// through the limits.
fn fastest(task: &Task, way: &Way, limits: &Limits) -> Vec<f64> {
    let length = way.longest().max(1e-9);
    let ball = |k: f64| {
        lowest_point(&task.geometry, way.lengths(k / GRID as f64))
            .map_or(task.start, |hang| hang.ball)
    };
    let h = 1.0 / GRID as f64;
    let top = (limits.rate / length).powi(2);
    let bound = |k: usize, square: f64| -> (f64, f64) {
        let x = (k as f64).clamp(1.0, GRID as f64 - 1.0);
        let (before, here, after) = (ball(x - 1.0), ball(x), ball(x + 1.0));
        let (slope, bend) =
            ((after - before) / (2.0 * h), ((after - here) - (here - before)) / (h * h));
        accelerations(task, here, slope, bend * square, limits.acceleration / length)
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

/// The least and greatest acceleration of progress with which each cable keeps its part of the
/// tension.
fn accelerations(
    task: &Task,
    ball: nalgebra::Point3<f64>,
    slope: Vector3<f64>,
    drift: Vector3<f64>,
    limit: f64,
) -> (f64, f64) {
    let Some(j) = task.geometry.jacobian(&ball) else { return (0.0, 0.0) };
    let (mut least, mut most) = (-limit, limit);
    for k in 0..3 {
        // T/m = -J'(g ẑ + a) >= kept · (-J' g ẑ)  <=>  J_k·a <= (1 - kept) g |J_zk|
        let column = j.column(k);
        let room = (1.0 - TENSION_KEPT) * G * column[2].abs() - column.dot(&drift);
        let slope = column.dot(&slope);
        if slope > 1e-12 {
            most = most.min(room / slope);
        } else if slope < -1e-12 {
            least = least.max(room / slope);
        }
    }
    (least, most)
}
