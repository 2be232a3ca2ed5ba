//! The measurements, each on a new chip.

use std::path::Path;

use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::message::{Command, Jog};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_tests::chip::{
    BALL_UM, CYCLES_PER_US, Chip, FAR_TARGET_UM, REVERSING_BALL_UM, Setup, fast_config,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::symbols::law_update;

/// Duration of a tick, cycles.
const TICK: u64 = 25_000;
/// Exception number of TIMER_IRQ_1, the stepping interrupt. It has the highest priority, so that
/// its time contains no other handler.
pub(crate) const STEPPING: u8 = 17;
/// A target that needs the same rate of all three motors from [`BALL_UM`], µm.
pub(crate) const EQUAL_RATES_TARGET_UM: [i32; 3] = [500_000, 300_000, 1_900_000];

fn start(image: &Path, rate: f64) -> Chip {
    start_with(image, rate, BenchLaw::Interval)
}

/// Returns a chip configured with a maximum of `rate` full steps/s and a law.
pub(crate) fn start_with(image: &Path, rate: f64, law: BenchLaw) -> Chip {
    Chip::start(image).configured(law.select(fast_config(rate, StepDir::TMC2209)))
}

/// Converts cycles to µs.
fn us(cycles: u64) -> f64 {
    cycles as f64 / CYCLES_PER_US as f64
}

/// Measures the pulse rate of the slowest moving axis over 0.1 s, 1/s: one axis alone, and three at
/// once.
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

/// Measures the processor load with 30 positions/s, percent: at 3 x 5 000 steps/s, at
/// 3 x 1 000 000 steps/s, and at 3 x 5 000 steps/s with law `taut`.
pub(crate) fn processor_load(image: &Path) -> [f64; 3] {
    let laws =
        [(312.5, BenchLaw::Interval), (62_500.0, BenchLaw::Interval), (312.5, BenchLaw::Taut)];
    laws.map(|(rate, law)| {
        let mut chip = start_with(image, rate, law);
        chip.seek(BALL_UM, EQUAL_RATES_TARGET_UM);
        chip.run_us(30_000);
        let before = sleep_counters(&mut chip);
        for at in 0..15 {
            chip.send_position([BALL_UM[0], BALL_UM[1], at * 1000]);
            chip.run_us(31_333);
        }
        let after = sleep_counters(&mut chip);
        100.0 * (1.0 - (after[1] - before[1]) / (after[0] - before[0]))
    })
}

/// Returns the cycles since power-on, and those asleep.
fn sleep_counters(chip: &mut Chip) -> [f64; 2] {
    let reply = chip.execute(json!({ "load": true }));
    ["cycles", "sleepCycles"].map(|name| reply["load"][name].as_f64().expect("cycles"))
}

/// Runs the chip for `us` µs and returns the rising edges of a pin, cycles.
pub(crate) fn rising_edges(chip: &mut Chip, pin: u8, us: u64) -> Vec<u64> {
    chip.execute(json!({ "list": [pin] }));
    let reply = chip.run_us(us);
    chip.execute(json!({ "list": [] }));
    let edges = reply["edges"].as_array().cloned().unwrap_or_default();
    edges.iter().filter(|edge| edge[2] == 1).filter_map(|edge| edge[0].as_u64()).collect()
}

/// Measures the maximum difference of periods within a segment, cycles, on any axis while all three
/// change their rates every tick. The phase of the segments is not visible from outside: the result
/// is the minimum over all phases.
pub(crate) fn jitter(image: &Path) -> f64 {
    let mut config = fast_config(62_500.0, StepDir::TMC2209);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(1_000_000));
    let worst = [2, 4, 6].map(|pin| {
        let mut chip = Chip::start(image).configured(config);
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.run_us(5_000);
        let rises = rising_edges(&mut chip, pin, 10_000);
        assert!(rises.len() > 500, "{}", rises.len());
        (0..TICK).step_by(25).map(|phase| spread(&rises, phase)).min()
    });
    worst.into_iter().flatten().max().expect("axes") as f64
}

/// Returns the maximum difference of periods within a segment, for segments that start at `phase`.
fn spread(rises: &[u64], phase: u64) -> u64 {
    let segment = |cycle: u64| (cycle + TICK - phase) / TICK;
    let of_one = rises.chunk_by(|&a, &b| segment(a) == segment(b));
    let spreads = of_one.filter(|rises| rises.len() > 2).map(|rises| {
        let periods = rises.windows(2).map(|pair| pair[1] - pair[0]);
        periods.clone().max().unwrap_or(0) - periods.min().unwrap_or(0)
    });
    spreads.max().unwrap_or(0)
}

/// Time from the last byte of a position to the first pulse with a new period, µs.
pub(crate) struct Latency {
    pub(crate) median: f64,
    pub(crate) worst: f64,
}

/// Measures the latency of 200 positions, 1 µs apart in the phase of the tick. At 1 M steps/s the
/// period is 125 cycles.
pub(crate) fn latency(image: &Path) -> Latency {
    let mut chip = start(image, 62_500.0);
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(40_000);
    let mut delays: Vec<u64> = (0..TICK)
        .step_by(TICK as usize / 200)
        .map(|phase| {
            chip.send_position(BALL_UM);
            let to_tick = TICK - chip.cycle % TICK;
            chip.execute(json!({ "run_cycles": 500_000 + to_tick + phase }));
            cycles_to_new_period(&mut chip, REVERSING_BALL_UM)
        })
        .collect();
    delays.sort_unstable();
    Latency { median: us(delays[100]), worst: us(delays[199]) }
}

/// Sends a position (µm) to a board whose first motor turns at 1 M steps/s, in 125 cycles a step.
/// Returns the cycles until the first pulse with another period.
pub(crate) fn cycles_to_new_period(chip: &mut Chip, ball: [i32; 3]) -> u64 {
    let frame = chip.position_frame(ball);
    let sent = chip.cycle;
    chip.send(&frame, 0);
    let rises = rising_edges(chip, 2, 900);
    let changed = rises.windows(2).find(|pair| pair[1] - pair[0] != 125);
    changed.expect("another rate")[0] - sent
}

/// A law that is measured.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum BenchLaw {
    Interval,
    Adaptive,
    Taut,
}

impl BenchLaw {
    /// Parses the law's name in a rig file.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        match name {
            "interval" => Some(Self::Interval),
            "adaptive" => Some(Self::Adaptive),
            "taut" => Some(Self::Taut),
            _ => None,
        }
    }

    /// Returns `setup` with this law.
    pub(crate) fn select(self, mut setup: Setup) -> Setup {
        let estimated = Estimated { delay: Milliseconds(0) };
        match self {
            Self::Interval => setup,
            Self::Adaptive => setup.with_law(Law::Adaptive(estimated)),
            Self::Taut => {
                setup.mean = Milliseconds(320);
                setup.with_law(Law::Taut(estimated))
            }
        }
    }
}

/// Execution times, cycles.
pub(crate) struct Costs {
    /// Maximum of the law's update, without the ticks that interrupt it.
    pub(crate) update: f64,
    /// Maximum of the law's update, with everything that interrupts it.
    pub(crate) response: f64,
    /// Maximum of the stepping interrupt with a position: from the first byte to telemetry.
    pub(crate) position_tick: f64,
    /// Median of the stepping interrupt without a position.
    pub(crate) tick: f64,
    /// Total lateness of the ticks.
    pub(crate) late: f64,
}

/// Measures the law's function and the stepping handler from entry to return, over 30 positions.
pub(crate) fn costs(image: &Path, law: BenchLaw) -> Costs {
    let config = law.select(fast_config(312.5, StepDir::TMC2209));
    let mut chip = Chip::start(image).configured(config);
    chip.seek(BALL_UM, FAR_TARGET_UM);
    let update = law_update(image, law != BenchLaw::Interval);
    chip.execute(json!({
        "trace": { "functions": { "update": update }, "handlers": { "tick": STEPPING } },
    }));
    for at in 0..30 {
        chip.send_position([BALL_UM[0] + 1000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
        chip.run_us(31_333);
    }
    let reply = chip.execute(json!({ "calls": true }));
    let [updates, ticks] = ["update", "tick"].map(|name| calls(&reply["calls"][name]));
    // A tick with a position contains the law's update, or is the last one before it.
    let nexts = ticks.iter().skip(1).map(|tick| tick.0).chain([u64::MAX]);
    let has_position =
        |((tick, _), next): &((u64, u64), u64)| updates.iter().any(|u| tick <= &u.0 && u.0 < *next);
    let (steps, others): (Vec<_>, Vec<_>) =
        ticks.iter().copied().zip(nexts).partition(has_position);
    assert!(updates.len() >= 25 && steps.len() >= 25, "{} positions", steps.len());
    let mut others: Vec<u64> = others.iter().map(|((_, cycles), _)| *cycles).collect();
    others.sort_unstable();
    Costs {
        update: longest(updates.iter().map(|call| without_interrupts(call, &ticks))),
        response: longest(updates.iter().map(|call| call.1)),
        position_tick: longest(steps.iter().map(|((_, cycles), _)| *cycles)),
        tick: others[others.len() / 2] as f64,
        late: lateness(&ticks),
    }
}

/// Returns the duration of a law's update without the ticks that preempt the law worker, cycles.
pub(crate) fn without_interrupts(update: &(u64, u64), ticks: &[(u64, u64)]) -> u64 {
    let inside = ticks.iter().filter(|tick| (update.0..update.0 + update.1).contains(&tick.0));
    update.1 - inside.map(|tick| tick.1).sum::<u64>()
}

/// Returns the longest of the durations, cycles.
pub(crate) fn longest(cycles: impl Iterator<Item = u64>) -> f64 {
    cycles.max().expect("calls") as f64
}

/// Returns how much later the last ticks start than the first. A late tick delays all that follow.
pub(crate) fn lateness(ticks: &[(u64, u64)]) -> f64 {
    let phase = |some: &[(u64, u64)]| {
        // The minimum is the timer's phase; the handler may start some cycles later if interrupts
        // are off.
        let phases = some.iter().map(|tick| (tick.0 - ticks[0].0 + TICK / 2) % TICK);
        phases.min().expect("ticks")
    };
    let (first, last) = (phase(&ticks[..100]), phase(&ticks[ticks.len() - 100..]));
    ((last + TICK - first) % TICK) as f64
}

/// Returns the start and the duration of each call, cycles.
pub(crate) fn calls(calls: &Value) -> Vec<(u64, u64)> {
    let pairs = calls.as_array().expect("calls").iter();
    pairs.filter_map(|call| Some((call[0].as_u64()?, call[1].as_u64()?))).collect()
}

/// Counts the late ticks while motors turn beside traffic on USB, by the firmware's own counter.
pub(crate) fn late_ticks(image: &Path, seconds: u64) -> f64 {
    let mut chip = start(image, 312.5);
    chip.turn_beside_traffic(seconds);
    f64::from(chip.counter(image, "LATE_TICKS"))
}

/// Measures the time from the opening of the emergency input to the start of the last pulse on any
/// axis, µs: the worst of 100.
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
        assert_eq!(chip.status().motors.map(Steps16::to_si)[..], chip.motors);
        chip.set_emergency(false);
        chip.run_us(1000);
        assert_eq!(chip.request(Command::ClearFault), None);
        last.saturating_sub(opened)
    });
    us(delays.max().expect("moments"))
}

/// Time from the host's last byte to the last pulse, ms.
pub(crate) struct Silence {
    pub(crate) measured: f64,
    /// Configured deadline and ramp.
    pub(crate) expected: f64,
}

/// Measures the reaction to a silent host.
pub(crate) fn silence(image: &Path) -> Silence {
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
    let last_byte = chip.cycle;
    chip.send(&frame, 1_000_000);
    let last = chip.pulses()[1].last.expect("pulses");
    Silence { measured: us(last - last_byte) / 1000.0, expected: 150.0 + 250.0 }
}
