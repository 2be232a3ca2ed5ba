//! Settings of the control law, the names of the laws, and the configuration of the board that
//! follows from the settings.

use std::fmt;
use std::str::FromStr;

use plumb_config::quantity::NumberError;
use plumb_protocol::config::{Estimated, Interval, Law, Sign};
use plumb_protocol::dimension::{LEAST_MOTORS, MotorList, PerAxis};
use plumb_protocol::units::{Bound, Gain, Milliseconds, SignGain};
use serde::{Deserialize, Deserializer};
use thiserror::Error;

use super::cables::CableSettings;
use super::quantity::{self, Conversion, Delay, JacobianBound, Mean, OutOfRange};

/// Nominal cable length of a step, metres: a pulley of 15 mm and 200 steps a turn. γ is given for
/// it. The true length is unknown; it scales γ.
pub const NOMINAL_STEP_M: f64 = 2.0 * std::f64::consts::PI * 0.015 / 200.0;

/// γ of the law `interval` on the paper's rig, 1/s.
const PAPER_GAMMA: quantity::Gain = quantity::Gain::constant(30.0);
/// α on the paper's rig, metres of ball a metre of cable.
const PAPER_ALPHA: JacobianBound = JacobianBound::constant(0.005);
/// β on the paper's rig, metres of ball a metre of cable.
const PAPER_BETA: JacobianBound = JacobianBound::constant(0.5);
/// Start value of g of the law `sign`, 1/s; a value of this project for the paper's rig.
const PAPER_SIGN_GAIN: quantity::SignGain = quantity::SignGain::constant(4.0);

/// Law and its parameters.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase")]
pub enum LawSettings {
    /// The paper's law, eqs. (7), (8).
    Interval {
        /// γ, 1/s, for a cable of [`NOMINAL_STEP_M`] a step.
        gamma: quantity::Gain,
        /// α: least |dp/du|, metres of ball a metre of cable.
        alpha: JacobianBound,
        /// β: largest |dp/du|.
        beta: JacobianBound,
        /// Σ: the signs of dp/du, rows x, y, z, a column for each motor; (12) where absent, or that
        /// of two motors.
        signs: Option<PerAxis<MotorList<i8>>>,
        /// Running mean over the step plan, seconds, at most 0.4; 0 is none.
        #[serde(default)]
        mean: Mean,
    },
    /// Law with a constant matrix from the signs (12).
    Sign {
        /// g, 1/s, for a cable of [`NOMINAL_STEP_M`] a step.
        gain: quantity::SignGain,
        /// As in `interval`.
        #[serde(default)]
        mean: Mean,
    },
    /// Law that estimates J while it drives, and uses it where descent is certain.
    Adaptive(Estimating),
    /// Law that estimates the geometry while it drives, and keeps the cables taut. Its running mean
    /// is 0.4 s where the table names none.
    #[serde(deserialize_with = "taut")]
    Taut(Estimating),
}

/// Parameters of a law that estimates.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimating {
    /// Delay of the frames beyond their age, seconds, at most 0.5.
    #[serde(default)]
    pub delay: Delay,
    /// Running mean over the step plan, seconds, at most 0.4; 0 is none.
    #[serde(default)]
    pub mean: Mean,
}

/// Reads the table of the law `taut`.
fn taut<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Estimating, D::Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        #[serde(default)]
        delay: Delay,
        mean: Option<Mean>,
    }

    let Table { delay, mean } = Table::deserialize(deserializer)?;
    Ok(Estimating { delay, mean: mean.unwrap_or(TAUT_MEAN) })
}

impl Default for LawSettings {
    /// Returns the law of a rig file without one: `taut` with its default parameters.
    fn default() -> Self {
        Self::Taut(Estimating { delay: Delay::default(), mean: TAUT_MEAN })
    }
}

impl From<LawName> for LawSettings {
    /// Returns the law with the parameters for the paper's rig.
    fn from(name: LawName) -> Self {
        let mean = Mean::default();
        match name {
            LawName::Interval => Self::Interval {
                gamma: PAPER_GAMMA,
                alpha: PAPER_ALPHA,
                beta: PAPER_BETA,
                signs: None,
                mean,
            },
            LawName::Sign => Self::Sign { gain: PAPER_SIGN_GAIN, mean },
            LawName::Adaptive => Self::Adaptive(Estimating::default()),
            LawName::Taut => Self::default(),
        }
    }
}

impl LawSettings {
    /// Returns the law's name.
    pub fn name(&self) -> LawName {
        match self {
            Self::Interval { .. } => LawName::Interval,
            Self::Sign { .. } => LawName::Sign,
            Self::Adaptive(_) => LawName::Adaptive,
            Self::Taut(_) => LawName::Taut,
        }
    }

    /// Returns the span of the running mean over the step plan.
    pub fn mean(&self) -> Mean {
        match self {
            Self::Interval { mean, .. } | Self::Sign { mean, .. } => *mean,
            Self::Adaptive(law) | Self::Taut(law) => law.mean,
        }
    }

    /// Sets the delay of the frames beyond their age, seconds, at most 0.5, of a law that has one.
    pub fn set_delay(&mut self, seconds: f64) {
        if let Self::Adaptive(law) | Self::Taut(law) = self
            && let Ok(delay) = Delay::try_from(seconds.clamp(0.0, 0.5))
        {
            law.delay = delay;
        }
    }

    /// Sets the span of the running mean.
    pub fn set_mean(&mut self, span: Mean) {
        match self {
            Self::Interval { mean, .. } | Self::Sign { mean, .. } => *mean = span,
            Self::Adaptive(law) | Self::Taut(law) => law.mean = span,
        }
    }
}

/// Span of the running mean of the law `taut`, seconds. It damps the swing of a ball on soft
/// cables.
const TAUT_MEAN: Mean = Mean::constant(0.4);

impl Mean {
    /// Converts the span to the board's unit. The error names `key`.
    ///
    /// # Errors
    /// Where the wire has no room for it: the range of the type has.
    pub fn config(self, key: &'static str) -> Result<Milliseconds, OutOfRange> {
        Conversion::first_error(|it| it.fit(key, self.get(), Milliseconds::from_si))
    }
}

impl LawSettings {
    /// Sets the gain γ of the law `interval`, 1/s. Returns whether the law has this gain.
    ///
    /// # Errors
    /// Where it is not above 0.
    pub fn set_gamma(&mut self, value: f64) -> Result<bool, NumberError> {
        let Self::Interval { gamma, .. } = self else { return Ok(false) };
        *gamma = value.try_into()?;
        Ok(true)
    }

    /// Returns the law and its parameters in a line.
    pub fn title(&self) -> String {
        match self {
            Self::Interval { gamma, alpha, beta, .. } => {
                let (gamma, alpha, beta) = (gamma.get(), alpha.get(), beta.get());
                format!("interval, γ = {gamma} /s, α = {alpha}, β = {beta}")
            }
            Self::Sign { gain, .. } => format!("sign, g = {} /s", gain.get()),
            Self::Adaptive(_) | Self::Taut(_) => self.name().to_string(),
        }
    }

    /// Returns the law for `motors` motors in the board's units.
    ///
    /// # Errors
    /// The first parameter that is beyond the range of the wire.
    pub fn config(&self, motors: usize) -> Result<Law, OutOfRange> {
        Conversion::first_error(|conversion| self.convert(motors, conversion))
    }

    /// Returns the law for `motors` motors in the board's units.
    pub(super) fn convert(&self, motors: usize, conversion: &mut Conversion) -> Law {
        match self {
            Self::Interval { gamma, alpha, beta, signs, .. } => {
                // Rounds outwards: the family on the chip contains the one that was asked for.
                let half = Bound::LSB / 2.0;
                let (alpha, beta) = (alpha.get(), beta.get());
                let alpha =
                    conversion.fit("law.interval.alpha", alpha, |a| Bound::from_si(a - half));
                let beta = conversion.fit("law.interval.beta", beta, |b| Bound::from_si(b + half));
                let gain = |gamma: f64| Gain::from_si(gamma * 1e-6 / NOMINAL_STEP_M);
                let gain = conversion.fit("law.interval.gamma", gamma.get(), gain);
                let family = if motors == LEAST_MOTORS {
                    Interval::planar(alpha, beta, gain)
                } else {
                    Interval::uniform(alpha, beta, gain)
                };
                Law::Interval(Interval { signs: signs.unwrap_or(family.signs), ..family })
            }
            Self::Sign { gain, .. } => {
                let raw = |g: f64| SignGain::from_si(g * 1e-6 / (4.0 * NOMINAL_STEP_M));
                Law::Sign(Sign { gain: conversion.fit("law.sign.gain", gain.get(), raw) })
            }
            Self::Adaptive(law) => {
                let delay = law.delay.get();
                let delay = conversion.fit("law.adaptive.delay", delay, Milliseconds::from_si);
                Law::Adaptive(Estimated { delay })
            }
            Self::Taut(law) => {
                let delay = law.delay.get();
                let delay = conversion.fit("law.taut.delay", delay, Milliseconds::from_si);
                Law::Taut(Estimated { delay })
            }
        }
    }

    /// Returns the span of the running mean, at most what the ball needs on these cables.
    pub fn mean_on(&self, cables: CableSettings) -> Mean {
        let longest = cables.longest_mean().filter(|_| matches!(self, Self::Taut(_)));
        longest.filter(|longest| longest.get() < self.mean().get()).unwrap_or(self.mean())
    }

    /// Returns the same in the board's unit.
    pub(super) fn convert_mean(
        &self,
        cables: CableSettings,
        conversion: &mut Conversion,
    ) -> Milliseconds {
        let key = match self.name() {
            LawName::Interval => "law.interval.mean",
            LawName::Sign => "law.sign.mean",
            LawName::Adaptive => "law.adaptive.mean",
            LawName::Taut => "law.taut.mean",
        };
        conversion.fit(key, self.mean_on(cables).get(), Milliseconds::from_si)
    }
}

/// Name of a control law, as in rig files, for `--law` and in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawName {
    /// The paper's law, eqs. (7), (8).
    Interval,
    /// Law with a constant matrix from the signs (12).
    Sign,
    /// Law that estimates J.
    Adaptive,
    /// Law that estimates the geometry and keeps the cables taut.
    Taut,
}

/// Error of parsing a name that no law has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("one of {}", LawName::ALL.map(LawName::as_str).join(", "))]
pub struct UnknownLaw;

impl LawName {
    /// All laws.
    pub const ALL: [Self; 4] = [Self::Interval, Self::Sign, Self::Adaptive, Self::Taut];

    /// Returns the name as text.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Interval => "interval",
            Self::Sign => "sign",
            Self::Adaptive => "adaptive",
            Self::Taut => "taut",
        }
    }
}

impl fmt::Display for LawName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for LawName {
    type Err = UnknownLaw;

    fn from_str(text: &str) -> Result<Self, UnknownLaw> {
        let is_it = |name: &Self| name.as_str().eq_ignore_ascii_case(text);
        Self::ALL.into_iter().find(is_it).ok_or(UnknownLaw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::LawSettings;

    #[test]
    fn a_table_of_taut_has_the_defaults_of_the_law() {
        let read = |text: &str| toml::from_str::<LawSettings>(text).unwrap();
        assert_eq!(read("[taut]"), LawSettings::default());
        assert_eq!(read("[taut]\ndelay = 0.04").mean(), LawSettings::default().mean());
        assert_eq!(read("[taut]\nmean = 0.0").mean(), Mean::default());
        assert_eq!(read("[adaptive]\ndelay = 0.04").mean(), Mean::default());
    }

    #[test]
    fn each_name_gives_its_law() {
        for name in LawName::ALL {
            assert_eq!(name.as_str().parse(), Ok(name));
            assert_eq!(name.as_str().to_uppercase().parse(), Ok(name));
            assert_eq!(LawSettings::from(name).name(), name);
        }
        let error = "certified".parse::<LawName>().unwrap_err();
        assert_eq!(error.to_string(), "one of interval, sign, adaptive, taut");
    }
}
