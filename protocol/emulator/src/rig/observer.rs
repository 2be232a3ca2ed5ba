//! What a camera would report of the ball: late, noisy, sometimes nothing, sometimes something
//! else.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::error::{RigError, check};

/// How a camera and its detector err. Camera axes are taken along the rig's; x is the depth axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverParameters {
    /// Frames a second; > 0.
    pub rate_hz: f64,
    /// Least and greatest latency from capture to delivery, frames; each frame's is uniform between
    /// them; >= 0.
    pub latency_frames: (f64, f64),
    /// Standard deviation of the white noise on x, y, z; metres, >= 0.
    pub noise_sd_m: [f64; 3],
    /// Noise on the depth axis that changes slowly, besides the white one.
    pub depth_drift: Option<DepthDrift>,
    /// Probability that a frame shows no ball, each frame for itself.
    pub dropout_probability: f64,
    /// Probability that a run of frames without a ball begins at a frame.
    pub burst_probability: f64,
    /// Least and greatest length of such a run, frames, uniform; the first at most the second.
    pub burst_frames: (u32, u32),
    /// Probability that the ball is reported somewhere else.
    pub outlier_probability: f64,
    /// How far away such a report is, metres, in a random direction; >= 0.
    pub outlier_size_m: f64,
}

/// First-order autoregressive noise: n = φ n' + √(1-φ²) sd ε, stationary from the first frame on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthDrift {
    /// Standard deviation, metres, >= 0.
    pub sd_m: f64,
    /// φ, the correlation of one frame with the next; 0 to less than 1.
    pub correlation: f64,
}

impl Default for ObserverParameters {
    /// The control notes' camera: 30 Hz, 1-2 frames late, white noise of (2, 1, 1) mm, 2 %
    /// drop-outs and now and then a burst of 3 to 10 frames.
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

impl ObserverParameters {
    /// No noise, no latency, nothing lost, at this frame rate.
    #[must_use]
    pub fn perfect(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            latency_frames: (0.0, 0.0),
            noise_sd_m: [0.0; 3],
            depth_drift: None,
            dropout_probability: 0.0,
            burst_probability: 0.0,
            burst_frames: (3, 10),
            outlier_probability: 0.0,
            outlier_size_m: 0.05,
        }
    }

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

/// What was seen in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// When the picture was taken, seconds.
    pub captured_at_s: f64,
    /// Where the ball was seen, metres in the rig frame; `None` where it was not.
    pub position: Option<Point3<f64>>,
}

/// A camera and detector that err as their parameters say: same seed, same errors.
///
/// At each frame time call [`Observer::observe`] with the true position; whenever time has passed,
/// take what [`Observer::delivered`] gives until it gives nothing. Frames arrive in the order in
/// which they were taken.
///
/// Noise, latency, drop-outs and outliers have a random stream each, of one draw a frame: changing
/// one of them leaves the others as they were.
#[derive(Debug, Clone)]
pub struct Observer {
    parameters: ObserverParameters,
    noise: ChaCha8Rng,
    delay: ChaCha8Rng,
    losses: ChaCha8Rng,
    outliers: ChaCha8Rng,
    drift_m: Option<f64>,
    blind_frames: u32,
    waiting: VecDeque<(f64, Observation)>,
    newest_arrival_s: f64,
}

impl Observer {
    /// An observer with these errors.
    ///
    /// # Errors
    /// [`RigError::OutOfRange`] names the parameter that is outside its range.
    pub fn new(parameters: ObserverParameters, seed: u64) -> Result<Self, RigError> {
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

    /// An observer that sees the truth at once, `rate_hz` times a second.
    ///
    /// # Errors
    /// Where the rate is not positive.
    pub fn perfect(rate_hz: f64) -> Result<Self, RigError> {
        Self::new(ObserverParameters::perfect(rate_hz), 0)
    }

    /// The time from a frame to the next, seconds.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.parameters.rate_hz.recip()
    }

    /// Takes a picture at `t_s` (seconds, growing from call to call) of a ball that is at `ball`
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

    /// The oldest observation that has arrived by `t_s` (seconds) and was not taken yet.
    pub fn delivered(&mut self, t_s: f64) -> Option<Observation> {
        self.waiting
            .pop_front_if(|(arrival, _)| *arrival <= t_s)
            .map(|(_, observation)| observation)
    }

    /// White noise and drift of one frame, metres.
    fn noise(&mut self) -> Vector3<f64> {
        let [x, y, z, slow]: [f64; 4] =
            std::array::from_fn(|_| StandardNormal.sample(&mut self.noise));
        let sd = self.parameters.noise_sd_m;
        Vector3::new(sd[0] * x + self.drift(slow), sd[1] * y, sd[2] * z)
    }

    /// The slow noise on the depth axis after the standard normal `draw`, metres.
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

    /// How far away from the ball this frame's report is for being wrong, metres; mostly nothing.
    fn outlier(&mut self) -> Vector3<f64> {
        let chance: f64 = self.outliers.random();
        let direction: [f64; 3] = rand_distr::UnitSphere.sample(&mut self.outliers);
        if chance < self.parameters.outlier_probability {
            Vector3::from(direction) * self.parameters.outlier_size_m
        } else {
            Vector3::zeros()
        }
    }

    /// Whether this frame shows no ball.
    fn lost(&mut self) -> bool {
        let [single, burst, length]: [f64; 3] = std::array::from_fn(|_| self.losses.random());
        if self.blind_frames == 0 && burst < self.parameters.burst_probability {
            let (least, greatest) = self.parameters.burst_frames;
            // At most `greatest`: `length` is less than 1.
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
