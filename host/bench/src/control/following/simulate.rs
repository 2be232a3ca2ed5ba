//! One run: a follower, a rig and a camera in virtual time.

use std::fmt;

use nalgebra::Point3;
use plumb_core::TICK_US;
use plumb_emulator::plant::{CameraMonitor, Plant, Task};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, PerMotor};

use super::super::BenchError;
use super::super::eye::PictureView;
use super::super::simulate::{STEP_S, TICKS_PER_STEP};
use super::super::suite::Suite;
use super::course::Course;
use super::deviation::{Deviations, Gauge};
use super::follower::CourseFollower;
use crate::run_id::RunId;

/// Duration of a run, seconds.
const DURATION_S: f64 = 12.0;
/// Steps of the plant between two measurements: 5 ms.
const STEPS_PER_SAMPLE: u64 = 5;

/// Reason that a run was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// The board stopped with a fault.
    Fault(Fault),
    /// The ball was more than 5 cm away from the reference.
    Strayed,
    /// The rig could not follow its motors.
    PlantFailed,
    /// The two jogs were refused.
    Refused,
    /// The controller did not follow the path when the measurement began.
    NotFollowed,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => write!(f, "stopped ({fault:?})"),
            Self::Strayed => f.write_str("left its path by 5 cm"),
            Self::PlantFailed => f.write_str("the rig could not follow"),
            Self::Refused => f.write_str("the jogs were refused"),
            Self::NotFollowed => f.write_str("did not follow"),
        }
    }
}

/// Result of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Outcome {
    /// Deviations, or why the run was lost.
    pub(super) deviations: Result<Deviations, Loss>,
    /// Longest total time that one cable was slack, seconds.
    pub(super) slack_s: f64,
}

/// A run in progress.
struct Simulation<'a> {
    follower: &'a mut dyn CourseFollower,
    plant: Box<dyn Plant>,
    camera: CameraMonitor,
    /// What the camera makes of a place, where the picture has a frame of its own.
    view: Option<&'a PictureView>,
    gauge: Gauge<'a>,
    /// Frames captured so far.
    frames: u32,
    /// Ticks of the board so far.
    ticks: u64,
    /// Total time that each cable was slack, seconds.
    slack_s: PerMotor<f64>,
}

impl Simulation<'_> {
    /// Runs one tick. Returns the loss of the run once there is one.
    fn tick(&mut self) -> Option<Loss> {
        let now = Micros(self.ticks * u64::from(TICK_US));
        self.run_camera(now);
        let motors = self.follower.tick(now);
        self.ticks += 1;
        if !self.ticks.is_multiple_of(TICKS_PER_STEP) {
            return None;
        }
        if self.plant.advance(STEP_S, motors).is_err() {
            return Some(Loss::PlantFailed);
        }
        for (sum, slack) in self.slack_s.iter_mut().zip(self.plant.slack()) {
            *sum += if slack { STEP_S } else { 0.0 };
        }
        if self.ticks.is_multiple_of(TICKS_PER_STEP * STEPS_PER_SAMPLE) {
            let at_s = (now.0 + u64::from(TICK_US)) as f64 * 1e-6;
            self.gauge.update(at_s, self.ball(at_s), self.follower.reading());
        }
        let strayed = self.gauge.is_lost().then_some(Loss::Strayed);
        self.follower.fault().map(Loss::Fault).or(strayed)
    }

    /// Returns where the ball is at a time of the run, seconds, in the frame of the path.
    fn ball(&self, at_s: f64) -> Point3<f64> {
        let ball = self.plant.ball();
        self.view.map_or(ball, |view| view.measured(at_s, ball))
    }

    /// Captures a frame if one is due, and passes arrived frames to the follower.
    fn run_camera(&mut self, now: Micros) {
        let t = now.0 as f64 * 1e-6;
        let due = f64::from(self.frames) * self.camera.period_s() <= t;
        if self.ticks.is_multiple_of(TICKS_PER_STEP) && due {
            self.camera.observe(t, self.ball(t));
            self.frames += 1;
        }
        while let Some(observed) = self.camera.delivered(t) {
            // The delay that the jogs have found stands for the age of a picture.
            let age_s = self.view.map_or(t - observed.captured_at_s, |_| 0.0);
            let age_us = (age_s * 1e6) as u32;
            self.follower.on_position(now, age_us, observed.position);
        }
    }
}

/// Runs `follower` on the path number `number` of a rig, in the frame of `view`. The ball of `task`
/// rests at the path's begin.
///
/// # Errors
/// If the parameters of the rig or the camera are invalid. A rig that cannot follow its motors is
/// an outcome ([`Loss::PlantFailed`]).
pub(super) fn run(
    follower: &mut dyn CourseFollower,
    course: &Course,
    (conditions, view): (&Suite, Option<&PictureView>),
    task: &Task,
    (id, number): (RunId, u64),
) -> Result<Outcome, BenchError> {
    let on_error = BenchError::of_rig(id);
    let camera_seed = id.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ id.rig ^ (number << 48);
    let mut simulation = Simulation {
        follower,
        plant: conditions.plant(task, id).map_err(on_error)?,
        camera: CameraMonitor::new(conditions.camera, camera_seed).map_err(on_error)?,
        view,
        gauge: Gauge::new(course),
        frames: 0,
        ticks: 0,
        slack_s: [0.0; MOTORS],
    };
    let ticks = (DURATION_S * 1e6) as u64 / u64::from(TICK_US);
    let loss = (0..ticks).find_map(|_| simulation.tick());
    let slack_s = simulation.slack_s.into_iter().fold(0.0, f64::max);
    let deviations = match loss {
        Some(loss) => Err(loss),
        None => simulation.gauge.deviations().ok_or(Loss::NotFollowed),
    };
    Ok(Outcome { deviations, slack_s })
}
