//! Limits of jogs.

use plumb_cameras::toml_file::Positive;
use plumb_protocol::config::JogLimits;
use plumb_protocol::units::{Rate, Steps16};
use serde::Deserialize;

use super::law::positive;
use super::{OutOfRange, fit};

/// See [`plumb_protocol::config::JogLimits`]. The defaults are a revolution of a motor with 200
/// steps, and a quarter of a revolution in a second.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JogSettings {
    /// Highest rate of a jog, full steps/s.
    pub max_rate: Positive,
    /// Longest distance of one jog, full steps.
    pub max_distance: Positive,
}

impl Default for JogSettings {
    fn default() -> Self {
        Self { max_rate: positive(50.0), max_distance: positive(200.0) }
    }
}

impl JogSettings {
    pub(super) fn config(&self) -> Result<JogLimits, OutOfRange> {
        Ok(JogLimits {
            max_rate: fit("jog.max_rate", self.max_rate.get(), Rate::from_si)?,
            max_distance: fit("jog.max_distance", self.max_distance.get(), Steps16::from_si)?,
        })
    }
}
