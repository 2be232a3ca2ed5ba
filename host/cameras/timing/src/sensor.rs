//! Sensors of an RGB-D camera.

use std::fmt;

/// Sensor of an RGB-D camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Red, green and blue.
    Colour,
    /// Depth along the optical axis.
    Depth,
}

impl Sensor {
    /// Returns the place of the sensor's state in an array: 0 for colour, 1 for depth.
    pub fn index(self) -> usize {
        match self {
            Self::Colour => 0,
            Self::Depth => 1,
        }
    }

    /// Returns the other sensor of a pair.
    pub fn other(self) -> Self {
        match self {
            Self::Colour => Self::Depth,
            Self::Depth => Self::Colour,
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
        })
    }
}
