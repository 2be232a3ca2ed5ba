//! Number of a run of a benchmark.

/// A run's number and the seed of its random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunId {
    /// Seed of rigs and noise.
    pub seed: u64,
    /// Number of the rig.
    pub rig: u64,
}
