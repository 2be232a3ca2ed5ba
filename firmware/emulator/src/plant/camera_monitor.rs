//! Positions of the ball with a camera's errors: latency, noise, drop-outs and outliers.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};
use plumb_protocol::{AXES, PerAxis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::interface::{RigError, check};

/// Errors of a camera and its detector. The camera's axes are parallel to the rig's; x is the depth
/// axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMonitorParameters {
    /// Frame rate, Hz; > 0.
    pub rate_hz: f64,
    /// Smallest and largest latency from capture to delivery, frames, >= 0. Each frame's latency is
    /// uniform between them.
    pub latency_frames: (f64, f64),
    /// Standard deviation of the white noise on x, y, z; metres, >= 0.
    pub noise_sd_m: PerAxis<f64>,
    /// Slow noise on the depth axis, in addition to the white noise.
    pub depth_drift: Option<DepthDrift>,
    /// Probability that a frame shows no ball, independent for each frame.
    pub dropout_probability: f64,
    /// Probability that a burst of frames without a ball begins at a frame.
    pub burst_probability: f64,
    /// Smallest and largest length of a burst, frames; uniform. The first is at most the second.
    pub burst_frames: (u32, u32),
    /// Probability that a report is an outlier.
    pub outlier_probability: f64,
    /// Distance of an outlier from the ball, metres, in a random direction; >= 0.
    pub outlier_size_m: f64,
}

/// First-order autoregressive noise n = φ n' + √(1-φ²) sd ε, stationary from the first frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthDrift {
    /// Standard deviation, metres, >= 0.
    pub sd_m: f64,
    /// φ: correlation of consecutive frames; 0 to less than 1.
    pub correlation: f64,
}

impl Default for CameraMonitorParameters {
    /// Returns the control notes' camera: 30 Hz, latency of 1 to 2 frames, white noise of (2, 1, 1)
    /// mm, 2 % drop-outs, and bursts of 3 to 10 frames with a probability of 0.2 % per frame.
    fn default() -> Self {
        Self {
            latency_frames: (1.0, 2.0),
            noise_sd_m: [2e-3, 1e-3, 1e-3],
            dropout_probability: 0.02,
            burst_probability: 0.002,
            ..Self::perfect(30.0)
        }
    }
}

impl CameraMonitorParameters {
    /// Returns a camera of this frame rate without noise, latency or losses.
    #[must_use]
    pub fn perfect(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            latency_frames: (0.0, 0.0),
            noise_sd_m: [0.0; AXES],
            depth_drift: None,
            dropout_probability: 0.0,
            burst_probability: 0.0,
            burst_frames: (3, 10),
            outlier_probability: 0.0,
            outlier_size_m: 0.05,
        }
    }

    /// Checks the ranges.
    fn check(&self) -> Result<(), RigError> {
        check("frame rate (Hz)", self.rate_hz, "greater than 0", |r| r > 0.0)?;
        check("least latency (frames)", self.latency_frames.0, "0 or more", |l| l >= 0.0)?;
        check(
            "greatest latency (frames)",
            self.latency_frames.1,
            "the least latency or more",
            |l| l >= self.latency_frames.0,
        )?;
        for sd in self.noise_sd_m {
            check("noise sd (m)", sd, "0 or more", |sd| sd >= 0.0)?;
        }
        if let Some(drift) = self.depth_drift {
            check("depth drift sd (m)", drift.sd_m, "0 or more", |sd| sd >= 0.0)?;
            check("depth drift correlation", drift.correlation, "0 to less than 1", |c| {
                (0.0..1.0).contains(&c)
            })?;
        }
        let probabilities = [
            ("drop-out probability", self.dropout_probability),
            ("burst probability", self.burst_probability),
            ("outlier probability", self.outlier_probability),
        ];
        for (name, value) in probabilities {
            check(name, value, "between 0 and 1", |p| (0.0..=1.0).contains(&p))?;
        }
        check(
            "greatest burst length (frames)",
            f64::from(self.burst_frames.1),
            "the least burst length or more",
            |b| b >= f64::from(self.burst_frames.0),
        )?;
        check("outlier size (m)", self.outlier_size_m, "0 or more", |s| s >= 0.0)?;
        Ok(())
    }
}

/// Measurement from one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Time of the exposure, seconds.
    pub captured_at_s: f64,
    /// Measured position of the ball, metres in the rig frame; `None` if the frame shows no ball.
    pub position: Option<Point3<f64>>,
}

/// Simulated camera and detector with the errors of their parameters. The same seed gives the same
/// errors.
///
/// Call [`CameraMonitor::observe`] with the true position at each frame time. Call
/// [`CameraMonitor::delivered`] whenever time has passed, until it returns `None`. Frames arrive in
/// the order in which they were taken.
///
/// Noise, latency, drop-outs and outliers have one random stream each, with the same number of
/// draws per frame: a change of one parameter does not change the other errors.
#[derive(Debug, Clone)]
pub struct CameraMonitor {
    parameters: CameraMonitorParameters,
    noise: ChaCha8Rng,
    delay: ChaCha8Rng,
    losses: ChaCha8Rng,
    outliers: ChaCha8Rng,
    drift_m: Option<f64>,
    blind_frames: u32,
    waiting: VecDeque<(f64, Observation)>,
    newest_arrival_s: f64,
}

impl CameraMonitor {
    /// Creates an observer with these errors.
    ///
    /// # Errors
    /// [`RigError::OutOfRange`] names the parameter that is out of range.
    pub fn new(parameters: CameraMonitorParameters, seed: u64) -> Result<Self, RigError> {
        parameters.check()?;
        let stream = |number| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(number);
            rng
        };
        Ok(Self {
            parameters,
            noise: stream(1),
            delay: stream(2),
            losses: stream(3),
            outliers: stream(4),
            drift_m: None,
            blind_frames: 0,
            waiting: VecDeque::new(),
            newest_arrival_s: f64::NEG_INFINITY,
        })
    }

    /// Creates an observer without errors and latency, with frames at `rate_hz`.
    ///
    /// # Errors
    /// If the rate is not positive.
    pub fn perfect(rate_hz: f64) -> Result<Self, RigError> {
        Self::new(CameraMonitorParameters::perfect(rate_hz), 0)
    }

    /// Returns the time from one frame to the next, seconds.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.parameters.rate_hz.recip()
    }

    /// Takes a picture at `t_s` (seconds, increasing from call to call) of a ball at `ball`
    /// (metres, rig frame).
    pub fn observe(&mut self, t_s: f64, ball: Point3<f64>) {
        let error = self.noise() + self.outlier();
        let position = (!self.lost()).then_some(ball + error);
        let (least, greatest) = self.parameters.latency_frames;
        let frames = least + (greatest - least) * self.delay.random::<f64>();
        self.newest_arrival_s = self.newest_arrival_s.max(t_s + frames * self.period_s());
        self.waiting
            .push_back((self.newest_arrival_s, Observation { captured_at_s: t_s, position }));
    }

    /// Removes and returns the oldest observation that has arrived by `t_s` (seconds).
    pub fn delivered(&mut self, t_s: f64) -> Option<Observation> {
        self.waiting
            .pop_front_if(|(arrival, _)| *arrival <= t_s)
            .map(|(_, observation)| observation)
    }

    /// Draws the white noise and drift of one frame, metres.
    fn noise(&mut self) -> Vector3<f64> {
        let [x, y, z, slow]: [f64; 4] =
            std::array::from_fn(|_| StandardNormal.sample(&mut self.noise));
        let sd = self.parameters.noise_sd_m;
        Vector3::new(sd[0] * x + self.drift(slow), sd[1] * y, sd[2] * z)
    }

    /// Updates the slow noise on the depth axis with the standard normal `draw`; metres.
    fn drift(&mut self, draw: f64) -> f64 {
        let Some(DepthDrift { sd_m, correlation }) = self.parameters.depth_drift else {
            return 0.0;
        };
        let next = match self.drift_m {
            Some(last) => {
                correlation * last + (1.0 - correlation * correlation).sqrt() * sd_m * draw
            }
            None => sd_m * draw,
        };
        self.drift_m = Some(next);
        next
    }

    /// Draws the outlier of one frame as an offset from the ball, metres; zero if there is none.
    fn outlier(&mut self) -> Vector3<f64> {
        let chance: f64 = self.outliers.random();
        let direction: PerAxis<f64> = rand_distr::UnitSphere.sample(&mut self.outliers);
        if chance < self.parameters.outlier_probability {
            Vector3::from(direction) * self.parameters.outlier_size_m
        } else {
            Vector3::zeros()
        }
    }

    /// Draws whether this frame shows no ball.
    fn lost(&mut self) -> bool {
        let [single, burst, length]: [f64; 3] = std::array::from_fn(|_| self.losses.random());
        if self.blind_frames == 0 && burst < self.parameters.burst_probability {
            let (least, greatest) = self.parameters.burst_frames;
            // The result is at most `greatest`, because `length` is below 1.
            let more = (f64::from(greatest - least) + 1.0) * length;
            self.blind_frames = least + (more as u32);
        }
        let blind = self.blind_frames > 0;
        self.blind_frames = self.blind_frames.saturating_sub(1);
        blind || single < self.parameters.dropout_probability
    }
}

#[cfg(test)]
mod tests;
