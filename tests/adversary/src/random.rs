//! Random numbers with a preference for the limits of their ranges.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A seeded source of random numbers.
#[derive(Debug, Clone)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// Returns the source of this seed.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a number below `count`; 0 if `count` is 0.
    pub fn below(&mut self, count: u64) -> u64 {
        if count == 0 { 0 } else { self.bits() % count }
    }

    /// Returns a number of `low..=high`.
    pub fn range(&mut self, low: i64, high: i64) -> i64 {
        low + self.below((high - low + 1) as u64) as i64
    }

    /// Returns true in one of `count` cases.
    pub fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    /// Returns true in `percent` of 100 cases.
    pub fn percent(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }

    /// Returns one of `values`, which must not be empty.
    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len() as u64) as usize]
    }

    /// Returns a number of `low..=high`: often a limit or its neighbour, often a small distance
    /// from `low` on a logarithmic scale.
    pub fn corner(&mut self, low: i64, high: i64) -> i64 {
        match self.below(8) {
            0 => low,
            1 => high,
            2 => (low + 1).min(high),
            3 => (high - 1).max(low),
            4 | 5 => self.range(low, high),
            _ => {
                let span = (high - low).max(1) as f64;
                let exponent = self.below(1 << 20) as f64 / (1 << 20) as f64;
                (low + span.powf(exponent) as i64).clamp(low, high)
            }
        }
    }

    /// Returns any 32-bit number: often a limit of the range, 0, or a small one.
    pub fn any_i32(&mut self) -> i32 {
        match self.below(6) {
            0 => i32::MIN,
            1 => i32::MAX,
            2 => 0,
            3 => self.bits() as i32,
            4 => (self.bits() as i32) >> self.below(32),
            _ => self.range(-5_000_000, 5_000_000) as i32,
        }
    }
}
