//! The cables, as far as a person knows them.

use serde::Deserialize;

use super::quantity::Mean;

/// Longest span of the running mean of the law `taut` on stiff cables, seconds: the slowest period
/// of a ball on cables of 800 N/m is 0.27 s on nine rigs of ten.
const STIFF_MEAN: Mean = Mean::constant(0.25);

/// The cables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CableSettings {
    /// Whether they stretch.
    pub stiffness: Stiffness,
}

/// How much cables stretch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Stiffness {
    /// Steel wire or braided line.
    Stiff,
    /// Nylon or elastic line.
    Soft,
    /// Not sure: treated as soft.
    #[default]
    Unknown,
}

impl Stiffness {
    /// All values.
    pub const ALL: [Self; 3] = [Self::Unknown, Self::Stiff, Self::Soft];

    /// Returns the value as in rig files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Stiff => "stiff",
            Self::Soft => "soft",
        }
    }
}

impl CableSettings {
    /// Returns the longest span of the running mean that the ball needs with the law `taut`; `None`
    /// where the law's own holds.
    pub(super) fn longest_mean(self) -> Option<Mean> {
        (self.stiffness == Stiffness::Stiff).then_some(STIFF_MEAN)
    }
}
