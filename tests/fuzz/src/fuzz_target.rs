//! A fuzz target.

/// A function that takes any input.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Name: of its module, of its corpus, and, after `fuzz_`, of its program for cargo-fuzz.
    pub name: &'static str,
    /// What the input is, for people.
    pub input: &'static str,
    /// Calls the target. Panics where the input breaks a rule.
    pub run: fn(&[u8]),
    /// Longest input of the seeded generator, bytes.
    pub max_length: usize,
    /// Number of inputs of the smoke run.
    pub smoke: u64,
    /// Pieces of text that inputs often contain.
    pub words: &'static [&'static str],
}
