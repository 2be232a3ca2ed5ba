//! Axes of the figures: round ticks, and a logarithmic scale where one curve dwarfs another.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Ratio of two curves above which a linear axis would leave too little room for the smaller one.
const DWARFS: f64 = 5.0;

/// Decades above which only powers of ten have a tick.
const MOST_DECADES: f64 = 3.3;

/// Axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    range: Range<f64>,
    scale: Scale,
}

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// Linear, with this distance between two ticks.
    Linear(f64),
    /// Logarithmic.
    Logarithmic,
}

impl Axis {
    /// Returns a linear axis with about `parts` parts between its ticks.
    #[must_use]
    pub fn linear(range: Range<f64>, parts: f64) -> Self {
        let step = round_step(range.end - range.start, parts);
        Self { range, scale: Scale::Linear(step) }
    }

    /// Returns a logarithmic axis. Values below its start, also zero, are drawn at its start.
    #[must_use]
    pub fn logarithmic(range: Range<f64>) -> Self {
        let start = range.start.max(1e-9);
        Self { range: start..range.end.max(1.001 * start), scale: Scale::Logarithmic }
    }

    /// Returns whether the axis is logarithmic.
    #[must_use]
    pub fn is_logarithmic(&self) -> bool {
        self.scale == Scale::Logarithmic
    }

    /// Returns the name of the axis with its scale, if that is not linear.
    #[must_use]
    pub fn name(&self, quantity: &str) -> String {
        let scale = if self.is_logarithmic() { ", logarithmic" } else { "" };
        format!("{quantity}{scale}")
    }

    /// Returns the values with a tick.
    #[must_use]
    pub fn ticks(&self) -> Vec<f64> {
        let Range { start, end } = self.range;
        match self.scale {
            Scale::Linear(step) => {
                let (first, last) = ((start / step - 1e-9).ceil(), (end / step + 1e-9).floor());
                let count = (last - first).clamp(0.0, 1e3) as u32;
                (0..=count).map(|k| (first + f64::from(k)) * step).collect()
            }
            Scale::Logarithmic => {
                let (low, high) = (start.log10().floor() as i32, end.log10().ceil() as i32);
                let is_long = (end / start).log10() > MOST_DECADES;
                let factors: &[f64] = if is_long { &[1.0] } else { &[1.0, 2.0, 5.0] };
                let all = (low..=high).flat_map(|k| factors.iter().map(move |f| f * 10f64.powi(k)));
                let margin = 1.0 + 1e-9;
                all.filter(|v| (start / margin..=end * margin).contains(v)).collect()
            }
        }
    }

    /// Returns the text of a tick.
    #[must_use]
    pub fn text(&self, value: f64) -> String {
        let last = match self.scale {
            Scale::Linear(step) => step,
            Scale::Logarithmic => value.abs().max(1e-9),
        };
        let digits = (-(last.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
        // Zero is added to write -0 as 0.
        format!("{:.digits$}", value + 0.0)
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let Range { start, end } = self.range;
        let share = match self.scale {
            Scale::Linear(_) => (value - start) / (end - start),
            Scale::Logarithmic => (value.max(start) / start).ln() / (end / start).ln(),
        };
        // Far outside a figure it does not matter where.
        from + (share.clamp(-100.0, 100.0) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.ticks()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.text(*value)
    }
}

/// Returns whether a curve that ends at `greatest` leaves too little of a linear axis for one that
/// ends at `least`.
#[must_use]
pub fn dwarfs(greatest: f64, least: f64) -> bool {
    least > 0.0 && greatest > DWARFS * least
}

/// Returns the length, 1, 2 or 5 times a power of ten, that divides `span` into `parts` parts or
/// slightly fewer.
pub(crate) fn round_step(span: f64, parts: f64) -> f64 {
    let raw = (span / parts).max(1e-6);
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= raw * 0.999_999);
    step.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|tick| axis.text(tick)).collect()
    }

    #[test]
    fn steps_are_round() {
        for (span, step) in
            [(1.0, 0.2), (0.83, 0.2), (0.5, 0.1), (3.1, 1.0), (0.012, 0.005), (0.0, 1e-6)]
        {
            let got = round_step(span, 5.0);
            assert!((got / step - 1.0).abs() < 1e-9, "{span}: {got}");
        }
    }

    #[test]
    fn a_linear_axis_has_round_ticks_with_as_many_digits_as_its_step_has() {
        assert_eq!(texts(&Axis::linear(0.0..3.2, 5.0)), ["0", "1", "2", "3"]);
        assert_eq!(texts(&Axis::linear(-0.1..0.21, 4.0)), ["-0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(texts(&Axis::linear(0.0..0.0, 4.0)).len(), 1);
    }

    #[test]
    fn a_logarithmic_axis_gives_each_decade_the_same_room() {
        let axis = Axis::logarithmic(0.1..10.0);
        assert_eq!(texts(&axis), ["0.1", "0.2", "0.5", "1", "2", "5", "10"]);
        let pixels = [0.1, 1.0, 10.0].map(|value| axis.map(&value, (0, 200)));
        assert_eq!(pixels, [0, 100, 200]);
        assert_eq!(axis.map(&0.0, (0, 200)), 0, "zero is drawn at the start");
        assert_eq!(texts(&Axis::logarithmic(0.01..100.0)).len(), 5, "powers of ten only");
    }
}
