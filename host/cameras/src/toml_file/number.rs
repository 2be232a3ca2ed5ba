//! Numbers with a range, for configuration files.

use serde::Deserialize;
use thiserror::Error;

/// Finite number above zero. Checked when it is read.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Positive(f64);

/// Finite number. Checked when it is read. The default is 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default, Deserialize)]
#[serde(try_from = "f64")]
pub struct Finite(f64);

/// Number out of its range.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NumberError {
    /// The number is not above zero, or not finite.
    #[error("{0} must be a finite number above 0")]
    NotPositive(f64),
    /// The number is not finite.
    #[error("{0} must be a finite number")]
    NotFinite(f64),
}

impl Positive {
    /// Returns `x` as a positive number.
    ///
    /// # Errors
    /// If `x` is not above zero or not finite.
    pub const fn new(x: f64) -> Result<Self, NumberError> {
        if x.is_finite() && x > 0.0 { Ok(Self(x)) } else { Err(NumberError::NotPositive(x)) }
    }

    /// Returns the number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Finite {
    /// Returns the number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Positive {
    type Error = NumberError;

    fn try_from(x: f64) -> Result<Self, NumberError> {
        Self::new(x)
    }
}

impl TryFrom<f64> for Finite {
    type Error = NumberError;

    fn try_from(x: f64) -> Result<Self, NumberError> {
        if x.is_finite() { Ok(Self(x)) } else { Err(NumberError::NotFinite(x)) }
    }
}
