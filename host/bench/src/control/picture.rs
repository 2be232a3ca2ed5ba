//! Two jogs of rigs of two motors that a camera of unknown place sees, and what they measure.

use nalgebra::{Matrix2, Point3, Vector2, Vector3};
use plumb_emulator::plant::{CameraMonitor, CameraMonitorParameters, Plant, RigError, Task};
use plumb_protocol::MOTORS;
use plumb_runtime::rig::PictureFrame;
use plumb_setup::two_jogs::{JogsError, Measured, Moving, RATE, TwoMotors, two_jogs};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::eye::{Defect, Eye, PictureView, Stand, WIDTH_PX};
use super::suite::Suite;
use crate::run_id::RunId;

/// Width of a picture in the plane, metres.
const WIDTHS_M: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// Largest way to a target, as a share of the picture's width.
const LONGEST_WAY: f64 = 0.6;
/// Time between two steps of the plant, seconds.
const STEP_S: f64 = 1e-3;
/// Standard deviation of the ball's place in a picture, pixels.
const NOISE_PX: f64 = 0.2;
/// Latency of the pictures, frames.
const LATENCY_FRAMES: f64 = 2.0;
/// Distance at which the ball counts as arrived, pixels.
pub(super) const ARRIVED_PX: f64 = 2.0;
/// Stream of the random numbers that give the camera.
const CAMERA_STREAM: u64 = 1 << 44;
/// Running mean of the board over the steps of a jog, seconds.
const MEAN_S: f64 = 0.2;
/// Time from the end of a jog to the first picture that counts, seconds.
const SETTLE_S: f64 = 0.4;

/// A rig, its camera, and the motors in reach of the jogs.
struct SimulatedHand {
    plant: Box<dyn Plant>,
    eye: Eye,
    /// Errors of the pictures; positions are (0, column, row) in pixels.
    camera: CameraMonitor,
    frames: u32,
    /// Steps of 1 ms so far.
    ticks: u64,
    turned: [f64; MOTORS],
}

impl SimulatedHand {
    /// Passes a millisecond. Returns the places of the ball in the pictures that arrive.
    fn step(&mut self) -> Result<Vec<Option<Vector2<f64>>>, ()> {
        let now = self.now();
        if f64::from(self.frames) * self.camera.period_s() <= now {
            let seen = self.eye.pixel(&self.plant.ball());
            self.camera.observe(now, Point3::new(0.0, seen.x, seen.y));
            self.frames += 1;
        }
        self.plant.advance(STEP_S, self.turned).map_err(|_| ())?;
        self.ticks += 1;
        let arrived = std::iter::from_fn(|| self.camera.delivered(now));
        Ok(arrived.map(|it| it.position.map(|at| at.coords.yz())).collect())
    }

    fn now(&self) -> f64 {
        self.ticks as f64 * STEP_S
    }
}

impl TwoMotors for SimulatedHand {
    type Error = ();

    fn look(&mut self, pictures: usize) -> Result<Vec<Vector2<f64>>, ()> {
        let (mut taken, mut seen) = (0, Vec::new());
        while taken < pictures {
            let arrived = self.step()?;
            taken += arrived.len();
            seen.extend(arrived.into_iter().flatten());
        }
        Ok(seen)
    }

    fn jog(&mut self, motor: usize, steps: f64) -> Result<Moving, ()> {
        let (begin, before) = (self.now(), self.turned[motor]);
        let end = begin + steps.abs() / RATE + MEAN_S + SETTLE_S;
        let mut moving = Moving::default();
        while self.now() < end {
            let steps = smooth_ramp(self.now() - begin, steps.abs() / RATE) * RATE * steps.signum();
            self.turned[motor] = before + steps;
            let arrived = self.step()?;
            let now = self.now();
            // The stamp of a picture is its arrival.
            moving.pictures.extend(arrived.into_iter().flatten().map(|at| (now, at)));
            moving.turned.push((now, steps));
        }
        Ok(moving)
    }
}

/// Returns the mean over the last [`MEAN_S`] at a time (seconds) of a ramp that rises by 1 a second
/// for `length` seconds.
fn smooth_ramp(time: f64, length: f64) -> f64 {
    let integral = |t: f64| {
        let t = t.max(0.0);
        if t < length { t * t / 2.0 } else { length * (t - length / 2.0) }
    };
    (integral(time) - integral(time - MEAN_S)) / MEAN_S
}

/// A rig after its two jogs.
pub(super) struct Jogged {
    pub(super) measured: Measured,
    pub(super) view: PictureView,
    /// The task from where the ball then hangs.
    pub(super) task: Task,
    /// The conditions in the frame of the picture.
    pub(super) suite: Suite,
}

impl Jogged {
    /// Returns the distance in the plane at which the ball counts as arrived, metres.
    pub(super) fn threshold_m(&self) -> f64 {
        let eye = &self.view.eye;
        let target = eye.pixel(&self.task.target);
        let sides = [Vector2::x(), Vector2::y()]
            .map(|side| (eye.point(target + side * ARRIVED_PX) - self.task.target).norm());
        (sides[0] + sides[1]) / 2.0
    }

    /// Returns the Jacobian at the end of the jogs, pixels a step.
    fn true_jacobian(&self) -> Matrix2<f64> {
        let Task { geometry, start, .. } = &self.task;
        let [a, b, _] = geometry.motors().map(|motor| (start - motor).normalize().yz());
        let rays = Matrix2::from_rows(&[a.transpose(), b.transpose()]);
        let [of_a, of_b, _] = geometry.step_lengths_m();
        let cables = Matrix2::new(of_a, 0.0, 0.0, of_b);
        let moved = rays.try_inverse().unwrap_or_default() * cables;
        let eye = &self.view.eye;
        Matrix2::from_columns(&[0, 1].map(|motor| {
            let way = Vector3::new(0.0, moved[(0, motor)], moved[(1, motor)]) * 1e-3;
            (eye.pixel(&(start + way)) - eye.pixel(start)) * 1e3
        }))
    }

    /// Returns how good the jogs were.
    pub(super) fn quality(&self) -> JogQuality {
        let (found, right) = (self.measured.jacobian_px, self.true_jacobian());
        let latency_s = LATENCY_FRAMES / CameraMonitorParameters::default().rate_hz;
        JogQuality {
            jacobian: (found - right).amax() / right.amax(),
            moved_px: (right * Vector2::from(self.measured.steps)).norm(),
            latency_ms: (self.measured.latency_s - latency_s).abs() * 1e3,
        }
    }
}

/// Errors of two jogs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JogQuality {
    /// Largest error of an entry of the Jacobian, as a share of its largest entry.
    pub(super) jacobian: f64,
    /// Way of the ball by both jogs, pixels.
    pub(super) moved_px: f64,
    /// Error of the latency, ms.
    pub(super) latency_ms: f64,
}

/// Jogs the motors of a rig. `None` where the jogs are refused.
///
/// # Errors
/// If no ball can hang in the rig.
pub(super) fn jog(
    suite: &Suite,
    stand: Stand,
    task: Task,
    id: RunId,
) -> Result<Option<Jogged>, RigError> {
    let mut rng = ChaCha8Rng::seed_from_u64(id.seed);
    rng.set_stream(CAMERA_STREAM | id.rig);
    let width = rng.random_range(WIDTHS_M);
    let task = nearer(task, LONGEST_WAY * width);
    let eye = Eye::new(nalgebra::center(&task.start, &task.target), width, stand, &mut rng);
    let in_pixels = CameraMonitorParameters {
        noise_sd_m: [0.0, NOISE_PX, NOISE_PX],
        latency_frames: (LATENCY_FRAMES, LATENCY_FRAMES),
        ..CameraMonitorParameters::default()
    };
    // The jogs of an earlier run, which ended where this one is to go.
    let is_kept = stand == Stand::Kept;
    let jogged_at = if is_kept { task.target } else { task.start };
    let mut hand = SimulatedHand {
        plant: suite.plant(&Task { start: jogged_at, ..task }, id)?,
        eye,
        camera: CameraMonitor::new(in_pixels, rng.random())?,
        frames: 0,
        ticks: 0,
        turned: [0.0; MOTORS],
    };
    let measured = match two_jogs(&mut hand) {
        Ok(measured) => measured,
        Err(JogsError::Refused(_) | JogsError::Rig(())) => return Ok(None),
    };
    let Some(frame) = PictureFrame::of(&measured.jacobian_px, WIDTH_PX) else { return Ok(None) };
    let noise_m = NOISE_PX * frame.scale;
    let suite = Suite {
        threshold_m: ARRIVED_PX * frame.scale,
        camera: CameraMonitorParameters { noise_sd_m: [0.0, noise_m, noise_m], ..in_pixels },
        assumed_frames: 0.0,
        prior: Some(frame.prior()),
        ..suite.clone()
    };
    let start = if is_kept { task.start } else { hand.plant.ball() };
    let task = Task { start, ..task };
    let knocked = (suite.defect == Some(Defect::Knocked)).then(|| eye.knocked(&mut rng));
    Ok(Some(Jogged { measured, view: PictureView { eye, frame, knocked }, task, suite }))
}

/// Returns the task with a way of at most `longest` metres.
fn nearer(task: Task, longest: f64) -> Task {
    let way = task.target - task.start;
    Task { target: task.start + way * (longest / way.norm()).min(1.0), ..task }
}
