//! Clocks of the real firmware in the emulated RP2350. Each test prints what it has measured.

use plumb_protocol::boards::PICO_2;
use plumb_protocol::config::{
    Estimated, Following, Growth, Interval, JogLimits, Law, Motor, Progress, Workspace,
};
use plumb_protocol::message::{Command, FromBoard, Hello, Position};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Point, Rate, Steps16,
};
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_protocol::{Config, Wiring};
use plumb_rp2350::chip::{CYCLES_PER_US, QUANTUM, TICK};
use plumb_rp2350::watch::Watch;
use plumb_rp2350::{Chip, Firmware, firmware_image};

/// Position of the ball, µm, and a target that needs the highest rate of every motor.
const BALL_UM: [i32; 3] = [500_000, 300_000, 0];
const FAR_TARGET_UM: [i32; 3] = [2_000_000, 100_000, 1_700_000];
/// Clocks of a millisecond.
const MS: u64 = 1000 * CYCLES_PER_US;

/// Returns a configuration for `rate` full steps/s with almost no ramp. A ball 2 m from its target
/// needs this rate.
fn fast_config(rate: f64, law: Law) -> Config {
    let motor = Motor {
        max_rate: Rate::from_si(rate).expect("a rate"),
        max_acceleration: Acceleration(4_000_000),
        travel_min: Steps16(-(1 << 29)),
        travel_max: Steps16(1 << 29),
        reversed: false,
    };
    let mean = Milliseconds(if matches!(law, Law::Taut(_)) { 320 } else { 0 });
    Config {
        law,
        mean,
        motors: [motor; 3].into(),
        jog: JogLimits { max_rate: motor.max_rate, max_distance: Steps16(1 << 28) },
        workspace: Workspace { min: point([-1_000_000; 3]), max: point([2_000_000; 3]) },
        growth: Growth { margin: Micrometres(1_000_000), time: Milliseconds(5_000) },
        following: Following { turn: Steps16(1_600_000), movement: Micrometres(1_000_000) },
        progress: Progress { margin: Micrometres(1), time: Milliseconds(60_000) },
        ..Config::example()
    }
}

fn interval() -> Law {
    Law::Interval(Interval::uniform(Bound(65536), Bound(65536), Gain(1 << 20)))
}

fn point(um: [i32; 3]) -> Point {
    Point(um.map(Micrometres))
}

/// A chip that has this configuration.
struct Bench {
    chip: Chip,
    sequence: u16,
}

impl Bench {
    fn new(firmware: &Firmware, config: Config) -> Self {
        let mut bench = Self { chip: Chip::start(firmware), sequence: 0 };
        let drivers = Drivers::StepDir(StepDir::TMC2209);
        let wiring = Wiring { board: PICO_2.kind, ..Wiring::pico(drivers) };
        for command in
            [Command::Hello(Hello::OURS), Command::Wire(wiring), Command::Configure(config)]
        {
            bench.send(command);
            bench.chip.run_us(2_000);
        }
        bench
    }

    fn send(&mut self, command: Command) {
        let (_, frame) = self.chip.frame(command);
        self.chip.send(&frame);
    }

    fn position(&mut self, um: [i32; 3]) {
        self.sequence += 1;
        let (sequence, ball) = (self.sequence, Some(point(um)));
        self.send(Command::Position(Position { sequence, age_us: 10_000, ball, covariance: None }));
    }

    fn seek(&mut self, ball: [i32; 3], target: [i32; 3]) {
        self.position(ball);
        self.send(Command::Target(point(target)));
        self.position(ball);
    }

    /// Returns the ticks that came late while motors turned.
    fn late_ticks(&mut self) -> u32 {
        self.send(Command::Diagnose);
        self.chip.run_us(3_000);
        let late = self.chip.received.iter().rev().find_map(|message| match message {
            FromBoard::Diagnostics(diagnostics) => Some(diagnostics.chip.late_ticks),
            _ => None,
        });
        late.expect("an answer to Diagnose")
    }
}

#[test]
fn the_laws_and_the_ticks_take_their_clocks() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    let estimated = Estimated { delay: Milliseconds(0) };
    let inline = ["plumb_core..law..selection..InlineLaw", "Law", "update"];
    let deferred = ["N10plumb_core10law_worker9LawWorker7respond"];
    for (name, law, parts, most) in [
        ("interval", interval(), &inline[..], 2_000),
        ("adaptive", Law::Adaptive(estimated), &deferred[..], 60_000),
        ("taut", Law::Taut(estimated), &deferred[..], 2 * MS),
    ] {
        let mut bench = Bench::new(&firmware, fast_config(312.5, law));
        bench.seek(BALL_UM, FAR_TARGET_UM);
        bench.chip.run_us(40_000);
        let function = firmware.function(parts).expect("the law's function");
        bench.chip.watch = Some(Watch::new(function));
        for at in 0..10 {
            bench.position([BALL_UM[0] + 1000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
            bench.chip.run_us(25_000);
        }
        let watch = bench.chip.watch.take().expect("a watch");
        let own = watch.calls.iter().map(|call| call.own).max().expect("calls");
        let total = watch.calls.iter().map(|call| call.total).max().expect("calls");
        let mut ticks = watch.ticks;
        ticks.sort_unstable();
        let (median, longest) = (ticks[ticks.len() / 2], ticks[ticks.len() - 1]);
        println!(
            "{name}: update {own} clocks, {total} with what interrupts it; \
             tick {median} (median), {longest} (longest)"
        );
        assert!(watch.calls.len() >= 8, "{name}: {} calls", watch.calls.len());
        assert!(own < most, "{name}: {own}");
        assert!(longest < TICK, "{name}: {longest}");
        assert_eq!(bench.late_ticks(), 0, "{name}");
    }
}

/// The stepping interrupt comes once for each tick, not twice for every other.
#[test]
fn a_tick_comes_every_200_us() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    for quantum in [1, QUANTUM] {
        let mut chip = Chip::start(&firmware);
        chip.quantum = quantum;
        chip.watch = Some(Watch::default());
        chip.run_us(10_000);
        let ticks = chip.watch.take().expect("a watch").ticks.len();
        assert!(ticks.abs_diff(50) <= 1, "{ticks} interrupts in 10 ms");
    }
}

/// Three motors at 1.25 million steps/s: no tick is late, and the pulses of a tick have one period.
#[test]
fn three_motors_at_the_highest_rate_have_no_jitter() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    let mut bench = Bench::new(&firmware, fast_config(78_125.0, interval()));
    bench.seek(BALL_UM, [500_000, 300_000, 1_900_000]);
    bench.chip.run_us(40_000);
    bench.chip.quantum = 1;
    bench.chip.pins.rises = Some(Default::default());
    bench.chip.run_us(5_000);
    for (motor, rises) in bench.chip.pins.rises.take().expect("a list").iter().enumerate() {
        let periods: Vec<u64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let [least, most] = [periods.iter().min(), periods.iter().max()].map(|p| *p.expect("some"));
        println!("motor {motor}: {} pulses in 5 ms, {least} to {most} clocks", rises.len());
        assert!(rises.len().abs_diff(6_250) <= 1, "{}", rises.len());
        assert_eq!([least, most], [120, 120], "motor {motor}");
    }
    bench.chip.quantum = 16;
    assert_eq!(bench.late_ticks(), 0);
}

/// From the last byte of a position to the first pulse with another period: the serial line's
/// receiver hands over the end of a frame after a pause of 3.2 bytes, a tick takes its message up
/// to 200 µs later, and plans 57 µs ahead.
#[test]
fn a_position_changes_the_rates_in_time() {
    let Some(image) = firmware_image() else { return };
    let firmware = Firmware::read(&image).expect("a firmware");
    let mut bench = Bench::new(&firmware, fast_config(62_500.0, interval()));
    bench.chip.set_byte(400);
    bench.seek(BALL_UM, FAR_TARGET_UM);
    bench.chip.run_us(40_000);
    let mut delays = Vec::new();
    for phase in 0..20 {
        bench.position(BALL_UM);
        bench.chip.quantum = 16;
        bench.chip.run_us(4_000);
        let to_tick = TICK - bench.chip.cycle() % TICK;
        bench.chip.run_us(to_tick / CYCLES_PER_US + 10 * phase);
        bench.chip.quantum = 1;
        bench.position([2_000_000, 0, 2_000_000]);
        let sent = bench.chip.last_byte();
        bench.chip.pins.rises = Some(Default::default());
        bench.chip.run_us(900);
        let [rises, ..] = bench.chip.pins.rises.take().expect("a list");
        let changed = rises.windows(2).find(|pair| pair[1] - pair[0] != 150);
        let changed = changed.expect("another rate");
        delays.push(changed[0] - sent);
    }
    delays.sort_unstable();
    let us = |cycles: u64| cycles as f64 / CYCLES_PER_US as f64;
    println!(
        "position to rate: {:.0} µs (median), {:.0} (longest)",
        us(delays[10]),
        us(delays[19])
    );
    assert!(delays[19] <= 300 * CYCLES_PER_US, "{delays:?}");
}
