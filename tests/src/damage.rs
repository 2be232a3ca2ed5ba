//! A link that damages what passes, from a seed.

use std::time::Duration;

use plumb::link::{LinkError, Transport};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How often what happens, per byte.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// A byte is lost.
    pub lost: f64,
    /// A bit is flipped.
    pub flipped: f64,
    /// A byte comes twice.
    pub doubled: f64,
    /// A random byte is inserted.
    pub inserted: f64,
}

/// Damages the bytes of another transport in both directions; the first `spared` bytes sent pass, so that the
/// greeting and the configuration succeed.
pub struct Damaged<T> {
    inner: T,
    rates: Rates,
    random: ChaCha8Rng,
    spared: usize,
    /// Bytes that were damaged.
    pub count: u64,
}

impl<T> Damaged<T> {
    /// Damages `inner` with the randomness of `seed`.
    pub fn new(inner: T, rates: Rates, spared: usize, seed: u64) -> Self {
        Self { inner, rates, random: ChaCha8Rng::seed_from_u64(seed), spared, count: 0 }
    }

    fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            let roll: f64 = self.random.random();
            let Rates { lost, flipped, doubled, inserted } = self.rates;
            let before = self.count;
            self.count += 1;
            if roll < lost {
            } else if roll < lost + flipped {
                out.push(byte ^ (1 << self.random.random_range(0..8)));
            } else if roll < lost + flipped + doubled {
                out.extend([byte, byte]);
            } else if roll < lost + flipped + doubled + inserted {
                out.extend([self.random.random(), byte]);
            } else {
                self.count = before;
                out.push(byte);
            }
        }
        out
    }
}

impl<T: Transport> Transport for Damaged<T> {
    fn name(&self) -> String {
        self.inner.name()
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let spared = self.spared.min(bytes.len());
        self.spared -= spared;
        let mut out = bytes[..spared].to_vec();
        out.append(&mut self.damage(&bytes[spared..]));
        self.inner.send(&out)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let mut received = Vec::new();
        self.inner.receive(&mut received, wait)?;
        if self.spared > 0 {
            bytes.extend_from_slice(&received);
        } else {
            let mut damaged = self.damage(&received);
            bytes.append(&mut damaged);
        }
        Ok(())
    }
}
