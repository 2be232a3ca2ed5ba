//! Estimate of the cables' tensions by the law `taut`, compared with the tensions of elastic rigs.

use std::time::Duration;

use plumb_emulator::plant::{CameraMonitor, Elastic, ElasticParameters, Population};
use plumb_protocol::message::State;
use plumb_protocol::units::Point;
use plumb_runtime::board_report::NEAR_SLACK;
use plumb_runtime::rig::LawName;

use crate::bench::{Bench, RATE_HZ, bench, wide_rig};
use crate::links::link;

/// Frames of a run: 12 s.
const FRAMES: usize = 12 * RATE_HZ as usize;

/// A run on a random elastic rig.
#[derive(Debug, Clone)]
pub struct TensionRun {
    /// Rigs and tasks.
    pub population: Population,
    /// Stiffness of the cables, N/m.
    pub stiffness_n_m: f64,
    /// Seed of the rig and of the camera's noise.
    pub seed: u64,
}

/// Tension of a cable in a frame, over the ball's weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time of the frame since the target was sent, s.
    pub time_s: f64,
    /// Estimate in the newest telemetry when the frame was captured.
    pub estimate: f64,
    /// Tension of the simulated rig at the capture.
    pub truth: f64,
}

impl TensionRun {
    /// Drives to the target and holds the ball there. Returns the samples of all cables, until the
    /// board stops or the time is over.
    ///
    /// # Panics
    /// If the run cannot be prepared, or the link fails.
    pub fn execute(&self) -> Vec<Sample> {
        let task = self.population.sample(3, self.seed).expect("a random rig");
        let parameters =
            ElasticParameters { stiffness_n_m: [self.stiffness_n_m; 3], ..Default::default() };
        let plant = Elastic::new(task.geometry, parameters, task.start).expect("a plant");
        let wire = (link("1 ms").wire)(self.seed);
        let mut bench = bench(&wide_rig(LawName::Taut), Box::new(plant), wire).expect("a board");
        let target = Point::from_metres(task.target.into()).expect("a target");
        bench.link.request_target(target).expect("an intact link");
        let mut camera = CameraMonitor::new(Default::default(), self.seed).expect("an observer");
        let mut samples = Vec::new();
        for frame in 0..FRAMES {
            let time_s = frame as f64 / RATE_HZ as f64;
            samples.extend(sample(&bench, time_s));
            camera.observe(time_s, bench.ball());
            let mut newest = None;
            while let Some(observation) = camera.delivered(time_s) {
                newest = Some(observation);
            }
            let (ball, age_s) =
                newest.map_or((None, 0.0), |seen| (seen.position, time_s - seen.captured_at_s));
            let followed = bench.report(ball, Duration::from_secs_f64(age_s));
            if followed.is_err() || matches!(bench.state(), State::Fault(_)) {
                break;
            }
        }
        samples
    }
}

/// Returns the samples of the three cables now; none before the first estimate.
fn sample(bench: &Bench, time_s: f64) -> Vec<Sample> {
    let telemetry = bench.link.telemetry();
    let estimates = telemetry.and_then(|telemetry| telemetry.tensions);
    let truths = bench.board.borrow().tensions_per_weight();
    let (Some(estimates), Some(truths)) = (estimates, truths) else { return Vec::new() };
    let pairs = estimates.iter().map(|estimate| estimate.to_si()).zip(truths);
    pairs.map(|(estimate, truth)| Sample { time_s, estimate, truth }).collect()
}

/// Summary of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Number of samples.
    pub samples: usize,
    /// Pearson's correlation of estimate and truth.
    pub correlation: f64,
    /// Median of |estimate - truth|, over the ball's weight.
    pub median_error: f64,
    /// 90th percentile of it.
    pub p90_error: f64,
    /// Samples whose estimate is near slack.
    pub marked: usize,
    /// Samples whose truth is below the same limit.
    pub low: usize,
    /// Samples that are both.
    pub marked_low: usize,
    /// Samples in which the cable is slack.
    pub slack: usize,
    /// Slack samples whose estimate is near slack.
    pub marked_slack: usize,
}

impl Agreement {
    /// Summarises `samples`; there must be one.
    pub fn of(samples: &[Sample]) -> Self {
        let mut errors: Vec<f64> = samples.iter().map(|s| (s.estimate - s.truth).abs()).collect();
        errors.sort_by(f64::total_cmp);
        let quantile = |q: f64| errors[(q * (errors.len() - 1) as f64) as usize];
        let count = |is: &dyn Fn(&Sample) -> bool| samples.iter().filter(|s| is(s)).count();
        let marked = |s: &Sample| s.estimate < NEAR_SLACK;
        let low = |s: &Sample| s.truth < NEAR_SLACK;
        let slack = |s: &Sample| s.truth <= 0.0;
        Self {
            samples: samples.len(),
            correlation: correlation(samples),
            median_error: quantile(0.5),
            p90_error: quantile(0.9),
            marked: count(&marked),
            low: count(&low),
            marked_low: count(&|s| marked(s) && low(s)),
            slack: count(&slack),
            marked_slack: count(&|s| marked(s) && slack(s)),
        }
    }
}

/// Returns Pearson's correlation of estimate and truth.
fn correlation(samples: &[Sample]) -> f64 {
    let n = samples.len() as f64;
    let mean = |of: fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / n;
    let (estimate, truth) = (mean(|s| s.estimate), mean(|s| s.truth));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        samples.iter().map(|s| of(s.estimate - estimate, s.truth - truth)).sum()
    };
    sum(&|e, t| e * t) / (sum(&|e, _| e * e) * sum(&|_, t| t * t)).sqrt()
}
