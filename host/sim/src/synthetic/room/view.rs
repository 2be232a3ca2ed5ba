//! A rendered room and its disparity.

use rand::{Rng, RngExt};

use crate::synthetic::sensor::{Disparity, Sensor};

/// A rendered room.
pub(in crate::synthetic) struct View {
    /// 8-bit blue, green, red, row by row.
    pub(in crate::synthetic) colour: Vec<u8>,
    /// Along the optical axis, metres.
    pub(in crate::synthetic) range: Vec<f32>,
    /// Whether the surface gives depth.
    pub(super) reflects: Vec<bool>,
}

impl View {
    /// Returns the disparity without noise, with holes in the projector's shadow, at lamps and
    /// windows, and at random along edges.
    pub(in crate::synthetic) fn disparity(
        &self,
        sensor: &Sensor,
        width: usize,
        random: &mut impl Rng,
    ) -> Vec<u16> {
        let mut disparity = Vec::with_capacity(self.range.len());
        for (range, reflects) in
            self.range.chunks_exact(width).zip(self.reflects.chunks_exact(width))
        {
            let row: Vec<u16> =
                range.iter().map(|&z| sensor.disparity.at_metres(f64::from(z))).collect();
            let ragged: f64 = random.random_range(-1.0..1.0);
            // Leftmost column of the projector that reaches past all surfaces to the right.
            let mut free = f64::INFINITY;
            let mut lit = vec![true; width];
            for column in (0..width).rev() {
                let place = column as f64 - Disparity::shadow(row[column], 0);
                lit[column] = place <= free + 1.0 + ragged || !sensor.options.holes;
                free = free.min(place);
            }
            for column in 0..width {
                let next = range[(column + 1).min(width - 1)];
                let edge = (next - range[column]).abs() > 0.03 * range[column];
                let lost = !reflects[column] || !lit[column] || (edge && random.random_bool(0.5));
                disparity.push(if lost && sensor.options.holes { 0 } else { row[column] });
            }
        }
        disparity
    }
}
