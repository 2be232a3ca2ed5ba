//! The single measurements, each on a chip of its own.

use std::path::Path;

use plumb_protocol::Config;
use plumb_protocol::config::{Estimated, Law, StepDir};
use plumb_protocol::message::{Command, Jog};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, Steps16};
use plumb_tests::chip::{BALL_UM, CYCLES_PER_US, Chip, FAR_TARGET_UM, fast_config};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::symbols::law_update;

/// A tick of the board, cycles.
const TICK: u64 = 25_000;
/// TIMER_IRQ_1, the stepping: above everything else, so that nothing else is in its time.
const STEPPING: u8 = 17;
/// A target that asks all three motors for the same rate from [`BALL_UM`].
pub(crate) const EQUAL_RATES_TARGET_UM: [i32; 3] = [500_000, 300_000, 1_900_000];
/// The ball beyond [`FAR_TARGET_UM`]: motors that hurried there are to turn round.
const REVERSING_BALL_UM: [i32; 3] = [2_000_000, 0, 2_000_000];

fn start(image: &Path, rate: f64) -> Chip {
    start_with(image, rate, BenchLaw::Interval)
}

/// A board that is configured with motors of this many steps/s and a law.
pub(crate) fn start_with(image: &Path, rate: f64, law: BenchLaw) -> Chip {
    Chip::start(image).configured(law.configured(fast_config(rate, StepDir::TMC2209)))
}

fn us(cycles: u64) -> f64 {
    cycles as f64 / CYCLES_PER_US as f64
}

/// Pulses/s of the slowest axis that turns, counted over 0.1 s: one alone, and three at once.
pub(crate) fn highest_rates(image: &Path) -> [f64; 2] {
    [true, false].map(|alone| {
        let mut chip = start(image, 78_125.0);
        if alone {
            let rate = Rate::from_si(78_125.0).expect("a rate");
            assert_eq!(
                chip.request(Command::Jog(Jog { motor: 0, distance: Steps16(1 << 28), rate })),
                None
            );
        } else {
            chip.seek(BALL_UM, EQUAL_RATES_TARGET_UM);
        }
        chip.run_us(40_000);
        chip.pulses();
        chip.run_us(100_000);
        let counts = chip.pulses().map(|pulses| pulses.count);
        let turning = if alone { &counts[..1] } else { &counts[..] };
        *turning.iter().min().expect("axes") as f64 * 10.0
    })
}

/// The share of the processor that is not asleep, percent, with 30 positions/s: at 3 x 5 000 and at
/// 3 x 1 000 000 steps/s, and at the former with the law `taut`.
pub(crate) fn busy(image: &Path) -> [f64; 3] {
    let laws =
        [(312.5, BenchLaw::Interval), (62_500.0, BenchLaw::Interval), (312.5, BenchLaw::Taut)];
    laws.map(|(rate, law)| {
        let mut chip = start_with(image, rate, law);
        chip.seek(BALL_UM, EQUAL_RATES_TARGET_UM);
        chip.run_us(30_000);
        let before = load(&mut chip);
        for at in 0..15 {
            chip.send_position([BALL_UM[0], BALL_UM[1], at * 1000]);
            chip.run_us(31_333);
        }
        let after = load(&mut chip);
        100.0 * (1.0 - (after[1] - before[1]) / (after[0] - before[0]))
    })
}

/// Cycles since power-on, and those asleep.
fn load(chip: &mut Chip) -> [f64; 2] {
    let reply = chip.execute(json!({ "load": true }));
    ["cycles", "sleepCycles"].map(|name| reply["load"][name].as_f64().expect("cycles"))
}

/// Rising edges of a pin while `us` pass, cycles.
fn rises(chip: &mut Chip, pin: u8, us: u64) -> Vec<u64> {
    chip.execute(json!({ "list": [pin] }));
    let reply = chip.run_us(us);
    chip.execute(json!({ "list": [] }));
    let edges = reply["edges"].as_array().cloned().unwrap_or_default();
    edges.iter().filter(|edge| edge[2] == 1).filter_map(|edge| edge[0].as_u64()).collect()
}

/// By how much the periods within a segment differ at most, cycles, on any axis while all three
/// change their rates every tick. Where the segments begin is not seen from outside: it is taken
/// where they differ least, the same all the time.
pub(crate) fn jitter(image: &Path) -> f64 {
    let mut config = fast_config(62_500.0, StepDir::TMC2209);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(1_000_000));
    let worst = [2, 4, 6].map(|pin| {
        let mut chip = Chip::start(image).configured(config);
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.run_us(5_000);
        let rises = rises(&mut chip, pin, 10_000);
        assert!(rises.len() > 500, "{}", rises.len());
        (0..TICK).step_by(25).map(|phase| spread(&rises, phase)).min()
    });
    worst.into_iter().flatten().max().expect("axes") as f64
}

/// The most by which periods between pulses of the same segment differ, with segments that begin at
/// `phase`.
fn spread(rises: &[u64], phase: u64) -> u64 {
    let segment = |cycle: u64| (cycle + TICK - phase) / TICK;
    let of_one = rises.chunk_by(|&a, &b| segment(a) == segment(b));
    let spreads = of_one.filter(|rises| rises.len() > 2).map(|rises| {
        let periods = rises.windows(2).map(|pair| pair[1] - pair[0]);
        periods.clone().max().unwrap_or(0) - periods.min().unwrap_or(0)
    });
    spreads.max().unwrap_or(0)
}

/// From the last byte of a position to the first pulse of another period, µs: median and worst of
/// 200 that come at any time between two ticks. At 1 M steps/s, where the period is 125 cycles.
pub(crate) fn latency(image: &Path) -> (f64, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut chip = start(image, 62_500.0);
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(40_000);
    let mut delays: Vec<u64> = (0..200)
        .map(|_| {
            chip.send_position(BALL_UM);
            chip.execute(json!({ "run_cycles": 500_000 + random.random_range(0..TICK) }));
            let frame = chip.position_frame(REVERSING_BALL_UM);
            let sent = chip.cycle;
            chip.send(&frame, 0);
            let rises = rises(&mut chip, 2, 700);
            let changed = rises.windows(2).find(|pair| pair[1] - pair[0] != 125);
            changed.expect("another rate")[0] - sent
        })
        .collect();
    delays.sort_unstable();
    (us(delays[100]), us(delays[199]))
}

/// BenchLaw law.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum BenchLaw {
    Interval,
    Adaptive,
    Taut,
}

impl BenchLaw {
    /// By the name that it has in a rig file.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            "interval" => Some(Self::Interval),
            "adaptive" => Some(Self::Adaptive),
            "taut" => Some(Self::Taut),
            _ => None,
        }
    }

    /// A configuration with this law, which is made for the law `interval`.
    fn configured(self, config: Config) -> Config {
        let estimated = Estimated { delay: Milliseconds(0) };
        match self {
            Self::Interval => config,
            Self::Adaptive => Config { law: Law::Adaptive(estimated), ..config },
            Self::Taut => Config { law: Law::Taut(estimated), mean: Milliseconds(320), ..config },
        }
    }
}

/// Cycles of the processor.
pub(crate) struct Costs {
    /// The law's update, at most; without the ticks that come in between.
    pub(crate) update: f64,
    /// The same with all that comes in between.
    pub(crate) thought: f64,
    /// The stepping interrupt with a position in it, at most: from the first byte to telemetry.
    pub(crate) step: f64,
    /// The same without, median.
    pub(crate) tick: f64,
    /// By how much ticks came late, all of them together.
    pub(crate) late: f64,
}

/// From entry to return of the law's function and of the stepping's handler, as the instructions go
/// by, over 30 positions.
pub(crate) fn costs(image: &Path, which: BenchLaw) -> Costs {
    let config = which.configured(fast_config(312.5, StepDir::TMC2209));
    let mut chip = Chip::start(image).configured(config);
    chip.seek(BALL_UM, FAR_TARGET_UM);
    let names = json!({ "functions": { "update": law_update(image, which != BenchLaw::Interval) }, "handlers": { "tick": STEPPING } });
    chip.execute(json!({ "trace": names }));
    for at in 0..30 {
        chip.send_position([BALL_UM[0] + 1000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
        chip.run_us(31_333);
    }
    let reply = chip.execute(json!({ "calls": true }));
    let [updates, ticks] = ["update", "tick"].map(|name| calls(&reply["calls"][name]));
    // The stepping interrupts what thinks, and never the other way round.
    let interrupted = |call: &(u64, u64)| -> u64 {
        let inside = ticks.iter().filter(|tick| call.0 <= tick.0 && tick.0 < call.0 + call.1);
        inside.map(|tick| tick.1).sum()
    };
    let longest = |cycles: &mut dyn Iterator<Item = u64>| cycles.max().expect("calls") as f64;
    // A tick with a position is one in which the law answers, or the last before its thinker does.
    let nexts = ticks.iter().skip(1).map(|tick| tick.0).chain([u64::MAX]);
    let asks =
        |((tick, _), next): &((u64, u64), u64)| updates.iter().any(|u| tick <= &u.0 && u.0 < *next);
    let (steps, others): (Vec<_>, Vec<_>) = ticks.iter().copied().zip(nexts).partition(asks);
    assert!(updates.len() >= 25 && steps.len() >= 25, "{} positions", steps.len());
    let mut others: Vec<u64> = others.iter().map(|((_, cycles), _)| *cycles).collect();
    others.sort_unstable();
    Costs {
        update: longest(&mut updates.iter().map(|call| call.1 - interrupted(call))),
        thought: longest(&mut updates.iter().map(|call| call.1)),
        step: longest(&mut steps.iter().map(|((_, cycles), _)| *cycles)),
        tick: others[others.len() / 2] as f64,
        late: lateness(&ticks),
    }
}

/// By how much later the last ticks come than the first: what is late once moves all that follow.
fn lateness(ticks: &[(u64, u64)]) -> f64 {
    let phase = |some: &[(u64, u64)]| {
        // Of the timer; the interrupt itself may wait a few cycles for others to be let in again.
        let phases = some.iter().map(|tick| (tick.0 - ticks[0].0 + TICK / 2) % TICK);
        phases.min().expect("ticks")
    };
    let (first, last) = (phase(&ticks[..100]), phase(&ticks[ticks.len() - 100..]));
    ((last + TICK - first) % TICK) as f64
}

/// `[began, cycles]` of each call.
fn calls(calls: &Value) -> Vec<(u64, u64)> {
    let pairs = calls.as_array().expect("calls").iter();
    pairs.filter_map(|call| Some((call[0].as_u64()?, call[1].as_u64()?))).collect()
}

/// From the opening of the emergency input to the beginning of the last pulse on any axis, µs: the
/// worst of 100.
pub(crate) fn emergency(image: &Path) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut chip = start(image, 62_500.0);
    let delays = (0..100).map(|_| {
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.execute(json!({ "run_cycles": 1_000_000 + random.random_range(0..TICK) }));
        let opened = chip.cycle;
        chip.set_emergency(true);
        chip.run_us(1000);
        let last = chip.pulses().iter().filter_map(|pulses| pulses.last).max().expect("pulses");
        assert_eq!(chip.status().motors.map(Steps16::to_si), chip.motors);
        chip.set_emergency(false);
        chip.run_us(1000);
        assert_eq!(chip.request(Command::ClearFault), None);
        last.saturating_sub(opened)
    });
    us(delays.max().expect("moments"))
}

/// From the last byte of the host to the last pulse, ms; and the deadline with the ramp that were
/// configured.
pub(crate) fn silence(image: &Path) -> (f64, u32) {
    let mut config = fast_config(1000.0, StepDir::TMC2209);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    config.deadlines.host = Milliseconds(150);
    let mut chip = Chip::start(image).configured(config);
    let jog =
        Jog { motor: 1, distance: Steps16(1 << 20), rate: Rate::from_si(1000.0).expect("a rate") };
    assert_eq!(chip.request(Command::Jog(jog)), None);
    for _ in 0..4 {
        chip.run_us(100_000);
        chip.status();
    }
    let frame = chip.frame(Command::Status);
    let spoke = chip.cycle;
    chip.send(&frame, 1_000_000);
    let last = chip.pulses()[1].last.expect("pulses");
    (us(last - spoke) / 1000.0, 150 + 250)
}
