//! Senders of targets: lines of JSON with the times at which they arrive, through the real intake.

use nalgebra::Point3;
use plumb_runtime::targets::{
    Arrivals, LeftOut, LineIntake, MotionId, SourceEnd, TargetSource, TimedTarget, target_channel,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Zero of the sender's clock, seconds on the host's.
const SENDER_ZERO_S: f64 = -1000.0;

/// A target that moves: its place at a time, seconds.
pub(crate) type Motion = fn(f64) -> Point3<f64>;

/// Line of a sender.
pub(crate) struct Sent {
    arrival: f64,
    text: String,
}

/// A sender of lines, with the times of their arrival.
pub(crate) struct Sender {
    lines: Vec<Sent>,
    intake: LineIntake,
    motion: MotionId,
    /// Line that comes next.
    next: usize,
    left_out: LeftOut,
}

impl Sender {
    /// Sends the places of `motion` at `rate` (Hz) from `begin` to `end` (seconds), each `delay`
    /// (seconds, of its number) late.
    pub(crate) fn new(
        motion: Motion,
        rate: f64,
        times: [f64; 2],
        delay: impl FnMut(u64) -> f64,
    ) -> Self {
        let [begin, end] = times;
        let numbers = (begin * rate) as u64..(end * rate) as u64;
        Self::of(numbers.map(|k| k as f64 / rate), motion, delay)
    }

    /// Sends the places of `motion` at `times`.
    pub(crate) fn of(
        times: impl Iterator<Item = f64>,
        motion: Motion,
        delay: impl FnMut(u64) -> f64,
    ) -> Self {
        Self::with_clock(times, motion, delay, |time| time)
    }

    /// Sends the places of `motion` at `times`, with the time stamps of a `clock`.
    pub(crate) fn with_clock(
        times: impl Iterator<Item = f64>,
        motion: Motion,
        mut delay: impl FnMut(u64) -> f64,
        clock: impl Fn(f64) -> f64,
    ) -> Self {
        let sent = (0..).zip(times).map(|(k, time)| {
            let [x, y, z] = motion(time).into();
            let t = clock(time) - SENDER_ZERO_S;
            let text = format!("{{\"t\": {t:.6}, \"target\": [{x}, {y}, {z}]}}\n");
            Sent { arrival: time + delay(k), text }
        });
        let mut lines: Vec<Sent> = sent.collect();
        lines.sort_by(|a, b| a.arrival.total_cmp(&b.arrival));
        let (intake, left_out) = (LineIntake::default(), LeftOut::default());
        // The motions of this source are those of a channel, where the first one is begun.
        Self { lines, intake, motion: target_channel().0.begin(), next: 0, left_out }
    }
}

impl TargetSource for Sender {
    fn take(&mut self, now: f64) -> Arrivals {
        let mut arrivals = Arrivals::default();
        while let Some(Sent { arrival, text }) =
            self.lines.get(self.next).filter(|line| line.arrival <= now)
        {
            match self.intake.take(text, *arrival) {
                Ok(Some((line, time))) => arrivals.targets.push(TimedTarget {
                    motion: self.motion,
                    time,
                    position: line.position(),
                    velocity: line.velocity(),
                }),
                Ok(None) => {}
                Err(omission) => {
                    omission.kind.count(&mut self.left_out);
                    arrivals.problems.push(omission.problem);
                }
            }
            self.next += 1;
        }
        arrivals.left_out = self.left_out;
        arrivals.end = (self.next == self.lines.len()).then_some(SourceEnd::Complete);
        arrivals
    }

    fn newest_motion(&self) -> MotionId {
        self.motion
    }
}

/// Two motions: targets of the second one come from its start on.
pub(crate) struct Two {
    senders: [Sender; 2],
}

impl Two {
    pub(crate) fn new(mut senders: [Sender; 2]) -> Self {
        let (channel, _) = target_channel();
        for sender in &mut senders {
            sender.motion = channel.begin();
        }
        Self { senders }
    }
}

impl TargetSource for Two {
    fn take(&mut self, now: f64) -> Arrivals {
        let [first, second] = &mut self.senders;
        let (mut arrivals, more) = (first.take(now), second.take(now));
        arrivals.targets.extend(more.targets);
        Arrivals { end: None, ..arrivals }
    }

    fn newest_motion(&self) -> MotionId {
        let [first, second] = &self.senders;
        if second.next > 0 { second.motion } else { first.motion }
    }
}

/// Delays of a busy network: up to 20 ms, every twentieth line 70 ms.
pub(crate) fn jitter(seed: u64) -> impl FnMut(u64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move |k| if k % 20 == 7 { 0.07 } else { random.random_range(0.0..0.02) }
}
