//! Samples of the motor positions at even intervals.

use std::collections::VecDeque;

use plumb_protocol::PerMotor;
use plumb_protocol::units::Micros;

/// Largest number of samples that wait for [`Sampler::take`], 10 s at 200 Hz. Beyond it the oldest
/// are dropped.
const WAITING_SAMPLES_MAX: usize = 2000;

/// Motor positions at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSample {
    /// Time on the board's clock.
    pub time: Micros,
    /// Motor positions, full steps since the rig's start, + pays out; order A, B, C.
    pub motors: PerMotor<f64>,
}

/// Samples that wait to be taken.
#[derive(Debug)]
pub(super) struct Sampler {
    interval: Micros,
    next: Micros,
    waiting: VecDeque<MotorSample>,
    dropped: u64,
}

impl Sampler {
    /// Creates a sampler with the first sample at `start`.
    pub(super) fn new(start: Micros, interval: Micros) -> Self {
        Self { interval, next: start, waiting: VecDeque::new(), dropped: 0 }
    }

    /// Adds a sample where one is due at `time`.
    pub(super) fn note(&mut self, time: Micros, motors: PerMotor<f64>) {
        if time < self.next {
            return;
        }
        self.next = Micros(self.next.0 + self.interval.0);
        if self.waiting.len() == WAITING_SAMPLES_MAX {
            self.waiting.pop_front();
            self.dropped += 1;
        }
        self.waiting.push_back(MotorSample { time, motors });
    }

    /// Takes the samples that wait, and the number of those that were dropped since the last call.
    pub(super) fn take(&mut self) -> (Vec<MotorSample>, u64) {
        (self.waiting.drain(..).collect(), std::mem::take(&mut self.dropped))
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::MOTORS;

    use super::*;

    #[test]
    fn samples_are_even_in_time_and_the_oldest_are_dropped() {
        let mut sampler = Sampler::new(Micros(0), Micros(5000));
        for tick in 0..=20 {
            sampler.note(Micros(tick * 1000), [tick as f64, 0.0, 0.0]);
        }
        let (samples, dropped) = sampler.take();
        let times: Vec<u64> = samples.iter().map(|sample| sample.time.0).collect();
        assert_eq!((times, dropped), (vec![0, 5000, 10_000, 15_000, 20_000], 0));
        assert_eq!(samples[3].motors, [15.0, 0.0, 0.0]);
        for tick in 21..=(21 + 5 * 2010) {
            sampler.note(Micros(tick * 1000), [0.0; MOTORS]);
        }
        let (samples, dropped) = sampler.take();
        assert_eq!((samples.len(), dropped), (WAITING_SAMPLES_MAX, 10));
    }
}
