//! Random numbers with a preference for the limits of their ranges, from a seed or from the input
//! of a fuzzer.

use arbitrary::Unstructured;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A source of numbers.
#[derive(Debug, Clone)]
pub struct Random(Source);

#[derive(Debug, Clone)]
enum Source {
    Seed(Box<ChaCha8Rng>),
    /// Bytes that are not used yet, from `at` on.
    Input {
        bytes: Vec<u8>,
        at: usize,
    },
}

impl Random {
    /// Returns the source of this seed.
    pub fn new(seed: u64) -> Self {
        Self(Source::Seed(Box::new(ChaCha8Rng::seed_from_u64(seed))))
    }

    /// Returns a source that takes its numbers from `input`. A number takes as few bytes as its
    /// range needs, so that a changed byte of the input changes one decision. After the end of the
    /// input all numbers are 0.
    pub fn of_input(input: &[u8]) -> Self {
        Self(Source::Input { bytes: input.to_vec(), at: 0 })
    }

    /// Returns whether the input is used up. A seed gives numbers without end.
    pub fn is_exhausted(&self) -> bool {
        match &self.0 {
            Source::Seed(_) => false,
            Source::Input { bytes, at } => *at >= bytes.len(),
        }
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        match &mut self.0 {
            Source::Seed(seed) => seed.next_u64(),
            Source::Input { bytes, at } => {
                take(bytes, at, |input| input.arbitrary().unwrap_or_default())
            }
        }
    }

    /// Returns a number below `count`; 0 if `count` is 0.
    pub fn below(&mut self, count: u64) -> u64 {
        match &mut self.0 {
            _ if count == 0 => 0,
            Source::Seed(seed) => seed.next_u64() % count,
            Source::Input { bytes, at } => {
                take(bytes, at, |input| input.int_in_range(0..=count - 1).unwrap_or_default())
            }
        }
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

/// Takes a number from the bytes from `at` on, and moves `at` behind those that it used.
fn take(bytes: &[u8], at: &mut usize, number: impl FnOnce(&mut Unstructured<'_>) -> u64) -> u64 {
    let mut input = Unstructured::new(bytes.get(*at..).unwrap_or_default());
    let number = number(&mut input);
    *at = bytes.len() - input.len();
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_gives_a_byte_for_each_small_number_and_then_zeros() {
        let mut random = Random::of_input(&[5, 255, 7]);
        assert_eq!([random.below(10), random.below(256), random.below(10)], [5, 255, 7]);
        assert!(random.is_exhausted());
        assert_eq!([random.below(10), random.bits()], [0, 0]);
        assert_eq!(random.range(-3, 3), -3);
    }

    #[test]
    fn a_range_of_one_value_takes_no_input() {
        let mut random = Random::of_input(&[9]);
        assert_eq!([random.below(1), random.below(0)], [0, 0]);
        assert!(!random.is_exhausted());
    }
}
