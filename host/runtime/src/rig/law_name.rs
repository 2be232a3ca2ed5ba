//! Names of the control laws.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

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
        Self::ALL.into_iter().find(|name| name.as_str() == text).ok_or(UnknownLaw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::LawSettings;

    #[test]
    fn each_name_gives_its_law() {
        for name in LawName::ALL {
            assert_eq!(name.as_str().parse(), Ok(name));
            assert_eq!(LawSettings::from(name).name(), name);
        }
        let error = "certified".parse::<LawName>().unwrap_err();
        assert_eq!(error.to_string(), "one of interval, sign, adaptive, taut");
    }
}
