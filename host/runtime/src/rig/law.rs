//! The control law as a person configures it, and what the board is told of it.

use plumb_cameras::toml_file::{NumberError, Positive};
use plumb_protocol::config::{Estimated, Interval, Law, SIGNS, Sign};
use plumb_protocol::units::{Bound, Gain, Milliseconds, SignGain};
use serde::Deserialize;

use super::{OutOfRange, fit};

/// The cable of a step that γ is given for, metres: a pulley of 15 mm and 200 steps a turn. The
/// true one is unknown, and only makes γ larger or smaller.
pub const NOMINAL_STEP_M: f64 = 2.0 * std::f64::consts::PI * 0.015 / 200.0;

/// The law and its parameters.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase")]
pub enum LawSettings {
    /// The paper's law, eqs. (7), (8).
    Interval {
        /// γ, 1/s, for a cable of [`NOMINAL_STEP_M`] a step.
        gamma: Positive,
        /// α: least |dp/du|, metres of ball a metre of cable.
        alpha: Positive,
        /// β: largest |dp/du|.
        beta: Positive,
        /// Σ: the signs of dp/du, rows x, y, z, columns A, B, C; (12) where absent.
        #[serde(default = "default_signs")]
        signs: [[i8; 3]; 3],
        /// Running mean over the step plan, seconds, at most 0.4; 0 is none.
        #[serde(default)]
        mean: Seconds,
    },
    /// A constant matrix from the signs (12).
    Sign {
        /// g, 1/s, for a cable of [`NOMINAL_STEP_M`] a step.
        gain: Positive,
        /// As in `interval`.
        #[serde(default)]
        mean: Seconds,
    },
    /// J is estimated while driving, and used where descent is certain.
    Adaptive(Estimating),
    /// The geometry is estimated while driving, and the cables are kept taut.
    Taut(Estimating),
}

/// What a law that estimates may be told.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimating {
    /// Delay of the pictures beyond their age, seconds, at most 0.5.
    #[serde(default)]
    pub delay: Seconds,
    /// Running mean over the step plan, seconds, at most 0.4; 0 is none.
    #[serde(default)]
    pub mean: Seconds,
}

/// A span of time that may be zero, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(transparent)]
pub struct Seconds(f64);

impl Seconds {
    /// No time.
    pub const ZERO: Self = Self(0.0);
}

impl From<f64> for Seconds {
    /// Any span; the board's range is checked when it is told.
    fn from(seconds: f64) -> Self {
        Self(seconds)
    }
}

fn default_signs() -> [[i8; 3]; 3] {
    SIGNS
}

impl Default for LawSettings {
    /// The law that is taken where none is named, with its usual parameters.
    fn default() -> Self {
        Self::Taut(Estimating { delay: Seconds::default(), mean: Seconds(TAUT_MEAN_S) })
    }
}

impl LawSettings {
    /// Every law's name, as in rig files and for `--law`.
    pub const NAMES: [&str; 4] = ["interval", "sign", "adaptive", "taut"];

    /// A law by its name, with the parameters of the paper's rig.
    pub fn named(name: &str) -> Option<Self> {
        let positive = |value: f64| Positive::try_from(value).ok();
        let none = Seconds::default();
        match name {
            "interval" => Some(Self::Interval {
                gamma: positive(30.0)?,
                alpha: positive(0.005)?,
                beta: positive(0.5)?,
                signs: SIGNS,
                mean: none,
            }),
            "sign" => Some(Self::Sign { gain: positive(4.0)?, mean: none }),
            "adaptive" => Some(Self::Adaptive(Estimating::default())),
            "taut" => Some(Self::default()),
            _ => None,
        }
    }

    /// The law's name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Interval { .. } => "interval",
            Self::Sign { .. } => "sign",
            Self::Adaptive(_) => "adaptive",
            Self::Taut(_) => "taut",
        }
    }

    /// Span of the running mean over the step plan.
    pub fn mean(&self) -> Seconds {
        match self {
            Self::Interval { mean, .. } | Self::Sign { mean, .. } => *mean,
            Self::Adaptive(law) | Self::Taut(law) => law.mean,
        }
    }

    /// Sets that.
    pub fn set_mean(&mut self, span: Seconds) {
        match self {
            Self::Interval { mean, .. } | Self::Sign { mean, .. } => *mean = span,
            Self::Adaptive(law) | Self::Taut(law) => law.mean = span,
        }
    }
}

/// What takes the shaking out of a ball on soft cables.
const TAUT_MEAN_S: f64 = 0.4;

impl Seconds {
    /// In the board's unit; `key` names it where it does not fit.
    ///
    /// # Errors
    /// Where it is negative, not a number or longer than a minute.
    pub fn config(self, key: &'static str) -> Result<Milliseconds, OutOfRange> {
        fit(key, self.0, Milliseconds::from_si)
    }
}

impl LawSettings {
    /// Sets the gain γ of the law `interval`, 1/s; others have none.
    ///
    /// # Errors
    /// Where it is not above 0.
    pub fn set_gamma(&mut self, value: f64) -> Result<(), NumberError> {
        if let Self::Interval { gamma, .. } = self {
            *gamma = value.try_into()?;
        }
        Ok(())
    }

    /// Sets the bounds α and β of the law `interval`, metres of ball a metre of cable; others have
    /// none.
    ///
    /// # Errors
    /// Where one is not above 0.
    pub fn set_bounds(&mut self, least: f64, largest: f64) -> Result<(), NumberError> {
        if let Self::Interval { alpha, beta, .. } = self {
            (*alpha, *beta) = (least.try_into()?, largest.try_into()?);
        }
        Ok(())
    }

    /// The law and its parameters in a line.
    pub fn title(&self) -> String {
        match self {
            Self::Interval { gamma, alpha, beta, .. } => {
                format!("interval, γ = {} /s, α = {}, β = {}", gamma.get(), alpha.get(), beta.get())
            }
            Self::Sign { gain, .. } => format!("sign, g = {} /s", gain.get()),
            Self::Adaptive(_) | Self::Taut(_) => self.name().to_owned(),
        }
    }

    /// What the board is told of it.
    ///
    /// # Errors
    /// Names the parameter that does not fit.
    pub fn config(&self) -> Result<Law, OutOfRange> {
        Ok(match self {
            Self::Interval { gamma, alpha, beta, signs, .. } => {
                // Outwards, so that the family on the chip contains the one that was asked for.
                let half = Bound::LSB / 2.0;
                let alpha = fit("law.interval.alpha", alpha.get(), |a| Bound::from_si(a - half))?;
                let beta = fit("law.interval.beta", beta.get(), |b| Bound::from_si(b + half))?;
                let gain = fit("law.interval.gamma", gamma.get(), |g| {
                    Gain::from_si(g * 1e-6 / NOMINAL_STEP_M)
                })?;
                Law::Interval(Interval { signs: *signs, ..Interval::uniform(alpha, beta, gain) })
            }
            Self::Sign { gain, .. } => {
                let raw = |g: f64| SignGain::from_si(g * 1e-6 / (4.0 * NOMINAL_STEP_M));
                Law::Sign(Sign { gain: fit("law.sign.gain", gain.get(), raw)? })
            }
            Self::Adaptive(law) => {
                Law::Adaptive(Estimated { delay: law.delay.config("law.adaptive.delay")? })
            }
            Self::Taut(law) => Law::Taut(Estimated { delay: law.delay.config("law.taut.delay")? }),
        })
    }
}
