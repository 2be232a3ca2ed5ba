//! A seeded generator of inputs: it changes those of a corpus.

use plumb_adversary::random::Random;

use crate::target::Target;

/// Most changes of an input.
const MAX_CHANGES: u64 = 8;
/// Longest run of bytes that a change inserts, removes or copies.
const MAX_RUN: u64 = 64;
/// Bytes at the limits of their ranges.
const LIMITS: [u8; 10] = [0, 1, 2, 9, 10, 32, 127, 128, 254, 255];

/// Generator of the inputs of a target. The same seed gives the same inputs.
#[derive(Debug)]
pub struct Generator<'a> {
    random: Random,
    target: &'a Target,
    corpus: &'a [Vec<u8>],
}

impl<'a> Generator<'a> {
    /// Returns a generator of changed inputs of `corpus`.
    pub fn new(seed: u64, target: &'a Target, corpus: &'a [Vec<u8>]) -> Self {
        Self { random: Random::new(seed), target, corpus }
    }

    /// Replaces `input` by the next one.
    pub fn next(&mut self, input: &mut Vec<u8>) {
        input.clear();
        if self.random.one_in(20) {
            let length = self.random.below(1 + self.target.max_length as u64);
            input.extend((0..length).map(|_| self.random.bits() as u8));
            return;
        }
        input.extend_from_slice(self.pick());
        for _ in 0..1 + self.random.below(MAX_CHANGES) {
            self.change(input);
        }
        input.truncate(self.target.max_length);
    }

    /// Returns an input of the corpus.
    fn pick(&mut self) -> &'a [u8] {
        let index = self.random.below(self.corpus.len() as u64) as usize;
        self.corpus.get(index).map_or(&[], Vec::as_slice)
    }

    /// Changes the input at one place.
    fn change(&mut self, input: &mut Vec<u8>) {
        let at = self.random.below(1 + input.len() as u64) as usize;
        let end = input.len().min(at + 1 + self.random.below(MAX_RUN) as usize);
        match self.random.below(9) {
            0 => replace(input, at, |byte| byte ^ (1 << (self.random.below(8)))),
            1 => replace(input, at, |_| self.random.bits() as u8),
            2 => replace(input, at, |_| self.random.pick(&LIMITS)),
            3 => {
                input.drain(at..end);
            }
            4 => {
                let copy = input[at..end].to_vec();
                insert(input, at, &copy);
            }
            5 => self.replace_number(input, at),
            6 if !self.target.words.is_empty() => {
                let word = self.random.pick(self.target.words);
                insert(input, at, word.as_bytes());
            }
            7 => {
                // The end of another input.
                let other = self.pick();
                let from = self.random.below(1 + other.len() as u64) as usize;
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            _ => {
                let run: Vec<u8> = (0..end - at).map(|_| self.random.bits() as u8).collect();
                insert(input, at, &run);
            }
        }
    }

    /// Replaces a little-endian number of 2, 4 or 8 bytes by one at the limits of its range.
    fn replace_number(&mut self, input: &mut [u8], at: usize) {
        let width = self.random.pick(&[2, 4, 8]);
        let Some(place) = input.get_mut(at..at + width) else { return };
        let number = match self.random.below(4) {
            0 => 0,
            1 => u64::MAX,
            2 => 1 << self.random.below(8 * width as u64),
            _ => (1 << self.random.below(8 * width as u64)) - 1,
        };
        place.copy_from_slice(&number.to_le_bytes()[..width]);
    }
}

/// Replaces the byte at `at`, if there is one.
fn replace(input: &mut [u8], at: usize, new: impl FnOnce(u8) -> u8) {
    if let Some(byte) = input.get_mut(at) {
        *byte = new(*byte);
    }
}

/// Inserts bytes at `at`.
fn insert(input: &mut Vec<u8>, at: usize, bytes: &[u8]) {
    input.splice(at..at, bytes.iter().copied());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target::frames;

    fn inputs(seed: u64) -> Vec<Vec<u8>> {
        let corpus = [b"one input".to_vec(), vec![0; 700]];
        let mut generator = Generator::new(seed, &frames::TARGET, &corpus);
        let mut input = Vec::new();
        let mut next = || {
            generator.next(&mut input);
            input.clone()
        };
        (0..500).map(|_| next()).collect()
    }

    #[test]
    fn the_same_seed_gives_the_same_inputs() {
        assert_eq!(inputs(1), inputs(1));
        assert_ne!(inputs(1), inputs(2));
    }

    #[test]
    fn inputs_are_changed_and_not_longer_than_allowed() {
        let inputs = inputs(3);
        assert!(inputs.iter().all(|input| input.len() <= frames::TARGET.max_length));
        let alike = inputs.iter().filter(|input| *input == b"one input").count();
        assert!(alike < 50, "{alike} of 500 are not changed");
    }
}
