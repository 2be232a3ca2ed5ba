//! How an object looks in a recorded frame.

/// Appearance of a composited object.
#[derive(Debug, Clone, Copy)]
pub struct Appearance {
    /// Standard deviation of its blur, pixels.
    pub blur: f64,
    /// Motion during the exposure, pixels.
    pub motion: (f64, f64),
    /// Time from the readout of the first row to that of the last, in exposure times; 0 = all rows
    /// at once.
    pub rolling: f64,
    /// Share of the pixels that lack depth at random; 1 = no depth.
    pub holes: f64,
    /// Whether edges blend in linear light, as in a lens, or in sRGB values, as in a drawing
    /// program.
    pub linear: bool,
}
