//! The error vector and its length.

use plumb_protocol::units::Point;

/// Returns e = `position` - `target`, µm; both within ±4 m a coordinate.
pub fn error(position: [i32; 3], target: Point) -> [i32; 3] {
    let target = target.micrometres();
    [0, 1, 2].map(|i| position[i] - target[i])
}

/// Returns |e| in whole micrometres, rounded down; e within ±8 m a coordinate, so 24 bits.
pub fn magnitude(e: [i32; 3]) -> u32 {
    let squares: u64 = e.iter().map(|c| u64::from(c.unsigned_abs()).pow(2)).sum();
    squares.isqrt() as u32
}
