//! Size and rate of pictures.

use std::fmt;

use plumb_frame::image::ImageSize;

/// Size and rate of pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Size.
    pub size: ImageSize,
    /// Pictures per second; 0 where it is unknown.
    pub rate: f64,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.size)?;
        if self.rate > 0.0 { write!(f, " at {} Hz", self.rate) } else { Ok(()) }
    }
}
