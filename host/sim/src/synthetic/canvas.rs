//! The frame in progress.

use super::sensor::Disparity;

/// A colour image and a disparity image of one size, row by row, that objects are drawn into.
pub(super) struct Canvas<'a> {
    /// Columns.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// 8-bit blue, green, red.
    pub(super) colour: &'a mut [u8],
    /// Disparity in the sensor's fine units, 0 = no depth.
    pub(super) disparity: &'a mut [u16],
    /// Conversion between depth and disparity.
    pub(super) sensor: &'a Disparity,
    /// Distance of the background along the optical axis, metres; `None` if it occludes nothing.
    pub(super) range: Option<&'a [f32]>,
}

impl Canvas<'_> {
    /// Columns and rows (first, and one past the last) of the pixels within `reach` pixels of (`u`,
    /// `v`); `None` where none of them is in the frame.
    pub(super) fn window(&self, u: f64, v: f64, reach: f64) -> Option<[usize; 4]> {
        let clip = |x: f64, size: usize| x.clamp(0.0, size as f64) as usize;
        let (left, right) =
            (clip((u - reach).floor(), self.width), clip((u + reach).ceil() + 1.0, self.width));
        let (top, bottom) =
            (clip((v - reach).floor(), self.height), clip((v + reach).ceil() + 1.0, self.height));
        (left < right && top < bottom).then_some([left, right, top, bottom])
    }

    /// Whether something at `z` metres along the optical axis is in front of the background at
    /// pixel `i`.
    pub(super) fn in_front(&self, i: usize, z: f64) -> bool {
        self.range.is_none_or(|range| z < f64::from(range[i]))
    }

    /// Blends `colour` (0 to 255; blue, green, red) over pixel `i` with the opacity `alpha` (0 to
    /// 1).
    pub(super) fn blend(&mut self, i: usize, colour: [f64; 3], alpha: f64) {
        for (below, over) in self.colour[3 * i..3 * i + 3].iter_mut().zip(colour) {
            let mixed = f64::from(*below) * (1.0 - alpha) + over * alpha;
            *below = (mixed + 0.5) as u8;
        }
    }

    /// Sets what the depth sensor meets at pixel `i`: a surface `z` metres along the optical axis,
    /// or `None`.
    pub(super) fn set_depth(&mut self, i: usize, z: Option<f64>) {
        self.disparity[i] = z.map_or(0, |z| self.sensor.at_metres(z));
    }
}
