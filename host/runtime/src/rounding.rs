//! Rounding of numbers for output.

/// Converts metres to millimetres, rounded to the micrometre.
pub fn millimetres(metres: f64) -> f64 {
    round(metres * 1e3, 1e3)
}

/// Rounds `value` to the nearest 1/`per`, for output without meaningless digits.
pub fn round(value: f64, per: f64) -> f64 {
    (value * per).round() / per
}
