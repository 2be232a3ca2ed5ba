//! Covering arrays: few rows with every combination of any four fields.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random rows of which the one with the most new combinations is taken.
const CANDIDATES: usize = 6;
/// More rows than any array here needs.
const MAX_ROWS: usize = 10_000;

/// Combinations of the values of any four fields.
struct Combinations {
    /// Number of the first value of each field, among the values of all fields.
    first: Vec<usize>,
    /// Number of values of all fields.
    values: usize,
    /// Whether a row has had the combination of this place.
    is_seen: Vec<bool>,
    /// Number of combinations that no row has had.
    left: usize,
}

impl Combinations {
    /// Returns the combinations of fields with so many values each.
    fn new(counts: &[usize]) -> Self {
        let values: usize = counts.iter().sum();
        let first = (0..counts.len()).map(|i| counts[..i].iter().sum()).collect();
        let product = |four: [usize; 4]| four.map(|i| counts[i]).iter().product::<usize>();
        let left = fours(counts.len()).map(product).sum();
        Self { first, values, is_seen: vec![false; values.pow(4)], left }
    }

    /// Returns the places of a row's combinations.
    fn places(&self, row: &[usize]) -> impl Iterator<Item = usize> {
        fours(row.len()).map(|four| {
            four.iter().fold(0, |place, &i| place * self.values + self.first[i] + row[i])
        })
    }

    /// Returns the number of combinations that are new in `row`.
    fn gain(&self, row: &[usize]) -> usize {
        self.places(row).filter(|place| !self.is_seen[*place]).count()
    }

    fn add(&mut self, row: &[usize]) {
        let places: Vec<usize> = self.places(row).collect();
        for place in places {
            self.left -= usize::from(!std::mem::replace(&mut self.is_seen[place], true));
        }
    }
}

/// Returns every four of `count` fields, in ascending order.
fn fours(count: usize) -> impl Iterator<Item = [usize; 4]> {
    let pairs = move |from| (from..count).flat_map(move |i| (i + 1..count).map(move |j| [i, j]));
    pairs(0).flat_map(move |[i, j]| pairs(j + 1).map(move |[k, l]| [i, j, k, l]))
}

/// Returns rows with a value of each field, of those from 0 on whose number is in `counts`. Every
/// combination of the values of any four fields is in a row.
pub(crate) fn rows_of_four(counts: &[usize]) -> Vec<Vec<usize>> {
    let mut random = ChaCha8Rng::seed_from_u64(15);
    let (mut combinations, mut rows) = (Combinations::new(counts), Vec::new());
    while combinations.left > 0 {
        assert!(rows.len() < MAX_ROWS, "{} combinations are left", combinations.left);
        let mut candidate =
            || counts.iter().map(|&count| random.random_range(0..count)).collect::<Vec<_>>();
        let candidates = [(); CANDIDATES].map(|()| candidate());
        let best = candidates.into_iter().max_by_key(|row| combinations.gain(row)).unwrap();
        combinations.add(&best);
        rows.push(best);
    }
    rows
}
