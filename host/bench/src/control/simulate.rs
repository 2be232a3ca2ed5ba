//! One run: a controller, a rig and a camera in virtual time.

use nalgebra::Point3;
use plumb_core::TICK_US;
use plumb_emulator::rig::{Observer, Plant, RigError, Task};
use plumb_protocol::units::Micros;

use super::suite::{ASSUMED_LATENCY_FRAMES, Clock, Suite};

/// Ticks between two looks at the rig: 1 ms.
const TICKS_A_LOOK: u64 = 5;

/// From "reached" until holding is judged, and for how long it is, seconds.
const SETTLE_S: f64 = 1.0;
const HOLD_S: f64 = 3.0;

/// The share of that time that the ball must be within the threshold for the run to have converged.
const KEPT: f64 = 0.95;

/// A run is given up after so many times the oracle's time, and so many seconds besides.
const PATIENCE: (f64, f64) = (15.0, 30.0);

/// What is put to the test: sees positions and moves motors.
pub(crate) trait Controller {
    /// A picture arrives at `now` that was, as far as anyone can tell, taken `age_us` earlier.
    fn see(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>);
    /// The motors over the tick that begins at `now`; where they are at its end, full steps, + pays
    /// out.
    fn tick(&mut self, now: Micros) -> [f64; 3];
    /// Whether it says that the ball has reached its target.
    fn reached(&self) -> bool;
    /// Whether it has given up.
    fn failed(&self) -> bool;
    /// Whether it stopped because it saw nothing for half a second, and was sent on.
    fn resumed(&self) -> bool {
        false
    }
}

/// What became of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Outcome {
    /// When the ball came within the threshold first, seconds by the suite's clock; `None` where it
    /// never did, where "reached" was never told, or where the ball was not kept there afterwards.
    pub(crate) time_s: Option<f64>,
    /// The longest that one cable was slack, all its times taken together, seconds.
    pub(crate) slack_s: f64,
    /// Distances from the target while holding, metres, one a millisecond.
    pub(crate) hold_m: Vec<f32>,
    /// Whether the target was said to be reached while the ball was outside the threshold.
    pub(crate) false_reached: bool,
    /// Whether it stopped because it had seen nothing for half a second, and was sent on.
    pub(crate) resumed: bool,
    /// How it ended.
    pub(crate) ending: &'static str,
}

/// What is watched during a run.
struct Watch {
    target: Point3<f64>,
    threshold_m: f64,
    /// When the clock started, which for all controllers is the same.
    first_s: Option<f64>,
    arrived_s: Option<f64>,
    slack_s: [f64; 3],
    reached_s: Option<f64>,
    outcome: Outcome,
}

impl Watch {
    /// Looks at the rig at `t` seconds; whether there is nothing more to be seen.
    fn look(&mut self, t: f64, plant: &dyn Plant, reached: bool) -> bool {
        let distance = (plant.ball() - self.target).norm();
        let inside = distance <= self.threshold_m;
        let dt = 1e-6 * (u64::from(TICK_US) * TICKS_A_LOOK) as f64;
        for (sum, slack) in self.slack_s.iter_mut().zip(plant.slack()) {
            *sum += if slack { dt } else { 0.0 };
        }
        if inside {
            let first = self.first_s.unwrap_or(0.0);
            self.arrived_s.get_or_insert(t - first);
        }
        if reached && self.reached_s.is_none() {
            self.reached_s = Some(t);
            self.outcome.false_reached = !inside;
        }
        let Some(since) = self.reached_s.filter(|_| self.arrived_s.is_some()) else { return false };
        if t >= since + SETTLE_S {
            self.outcome.hold_m.push(distance as f32);
        }
        t >= since + SETTLE_S + HOLD_S
    }

    fn outcome(self, complete: bool) -> Outcome {
        let slack_s = self.slack_s.into_iter().fold(0.0, f64::max);
        let hold = &self.outcome.hold_m;
        let inside = hold.iter().filter(|d| f64::from(**d) <= self.threshold_m).count();
        let kept = complete && inside as f64 >= KEPT * hold.len() as f64;
        let ending = if complete && !kept { "did not keep there" } else { self.outcome.ending };
        Outcome { time_s: self.arrived_s.filter(|_| kept), slack_s, ending, ..self.outcome }
    }
}

/// Lets `controller` drive the ball of a task of `suite`; the oracle needs `oracle_s` for it.
///
/// # Errors
/// Where the rig cannot be, or the camera. A rig that cannot follow its motors is a run that
/// failed.
pub(crate) fn run(
    controller: &mut dyn Controller,
    suite: &Suite,
    task: &Task,
    (seed, index): (u64, u64),
    oracle_s: f64,
) -> Result<Outcome, RigError> {
    let mut plant = suite.plant(task, seed, index)?;
    let mut camera = Observer::new(suite.camera, seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index)?;
    let age_us = (ASSUMED_LATENCY_FRAMES * camera.period_s() * 1e6) as u32;
    let mut watch = Watch {
        target: task.target,
        threshold_m: suite.threshold_m,
        first_s: (suite.clock == Clock::Target).then_some(0.0),
        arrived_s: None,
        slack_s: [0.0; 3],
        reached_s: None,
        outcome: Outcome::default(),
    };
    let (mut frames, mut tick, mut complete) = (0u32, 0u64, false);
    while !complete {
        let now = Micros(tick * u64::from(TICK_US));
        let t = now.0 as f64 * 1e-6;
        if t > oracle_s * PATIENCE.0 + PATIENCE.1 || controller.failed() {
            watch.outcome.ending = if controller.failed() { "gave up" } else { "took too long" };
            break;
        }
        if tick.is_multiple_of(TICKS_A_LOOK) && f64::from(frames) * camera.period_s() <= t {
            camera.observe(t, plant.ball());
            frames += 1;
        }
        while let Some(seen) = camera.delivered(t) {
            watch.first_s.get_or_insert(t);
            let age_us =
                if suite.ages_known { ((t - seen.captured_at_s) * 1e6) as u32 } else { age_us };
            controller.see(now, age_us, seen.position);
        }
        let motors = controller.tick(now);
        tick += 1;
        if tick.is_multiple_of(TICKS_A_LOOK) {
            if plant.advance(1e-6 * (TICKS_A_LOOK * u64::from(TICK_US)) as f64, motors).is_err() {
                watch.outcome.ending = "the rig could not follow";
                break;
            }
            complete = watch.look(t + 1e-6 * f64::from(TICK_US), &*plant, controller.reached());
        }
    }
    watch.outcome.resumed = controller.resumed();
    Ok(watch.outcome(complete))
}
