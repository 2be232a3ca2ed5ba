//! The real firmware in the emulated chip against the emulated board. The same commands in the same
//! ticks give the same bytes, and the edges on the chip's STEP and DIR pins count the reported
//! steps.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::{Point3, Vector3};
use plumb_core::TICK_US;
use plumb_emulator::plant::{Plant, Task};
use plumb_path::trajectory::Moment;
use plumb_protocol::message::{Command, Fault, Position, State};
use plumb_protocol::units::Point;
use plumb_runtime::reference::{INTERVAL_S, reference};
use plumb_runtime::rig::quantity::Current;
use plumb_runtime::rig::{BoardName, Driver, LawName, LawSettings, Rig, UartSettings};
use plumb_tests::chip::{Chip, Pair, firmware_image};
use plumb_tests::is_long;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// Starts a chip with the paper's rig and target, and a law.
fn seeking(image: &std::path::Path, law: LawSettings) -> Pair {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law = law;
    let mut pair = Pair::new(Chip::start(image), &Task::paper());
    pair.request(Command::Wire(rig.wiring().expect("a wiring")));
    pair.request(Command::Configure(rig.config().expect("a configuration")));
    pair.request(Command::Target(rig.targets().expect("a target")[0]));
    pair
}

/// Starts an SKR Pico, four TMC2209 on its UART, with the paper's rig and target.
fn seeking_on_an_skr_pico(image: &std::path::Path) -> Pair {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.board.kind = BoardName::SkrPico;
    let run_current = Current::constant(0.8);
    rig.motors.driver = Driver::Tmc2209Uart(UartSettings::new(run_current));
    let wiring = rig.wiring().expect("a wiring");
    let mut chip = Chip::start_with(image, &wiring.pins);
    chip.plug_in_skr_drivers();
    let mut pair = Pair::new(chip, &Task::paper());
    pair.request(Command::Wire(wiring));
    pair.request(Command::Configure(rig.config().expect("a configuration")));
    // Their drivers take time to be set up, each its own.
    pair.run(300_000);
    pair.request(Command::Target(rig.targets().expect("a target")[0]));
    pair
}

/// Returns law `interval` with a higher gain than the paper's.
fn interval() -> LawSettings {
    let mut law = LawSettings::from(LawName::Interval);
    law.set_gamma(100.0).expect("a gain");
    law
}

/// With every law in the long form. A path is driven with every law in both forms.
#[test]
fn the_papers_task_is_the_same_to_the_bit() {
    let Some(image) = firmware_image() else { return };
    let laws = [interval(), LawName::Taut.into(), LawName::Sign.into(), LawName::Adaptive.into()];
    for law in laws.into_iter().take(if is_long() { 4 } else { 2 }) {
        let name = law.name();
        let mut pair = seeking(&image, law);
        let mut frames = 0;
        while pair.state() != State::Holding {
            pair.frame();
            frames += 1;
            assert!(
                frames < 1000 && pair.state() != State::Fault(Fault::HostSilent),
                "{name}: {}",
                pair.state()
            );
        }
        pair.request(Command::Stop);
        pair.run(600_000);
        pair.assert_agree(name.as_str());
        let error = (pair.plant.ball() - Task::paper().target).norm();
        assert!(error < 0.010, "{name}: {error} m");
    }
}

/// The pulses are counted at the pins of the SKR Pico, where DIR of X and Y is inverted, and by the
/// emulated drivers.
#[test]
fn the_papers_task_is_the_same_on_the_pins_of_an_skr_pico() {
    let Some(image) = firmware_image() else { return };
    let mut pair = seeking_on_an_skr_pico(&image);
    let mut frames = 0;
    while pair.state() != State::Holding {
        pair.frame();
        frames += 1;
        assert!(frames < 1000, "{}", pair.state());
    }
    for pin in [12, 7, 2] {
        assert_eq!(pair.chip.pin_level(pin), 0, "GP{pin}: the drivers are on");
    }
    // ENABLE of driver E is off; fans, heaters and the RGB light are low.
    assert_eq!(pair.chip.pin_level(15), 1);
    for pin in [17, 18, 20, 21, 23, 24] {
        pair.chip.drive_pin(pin, Some(1));
        assert_eq!(pair.chip.pin_level(pin), 0, "GP{pin} is held low");
    }
    pair.request(Command::Stop);
    pair.run(600_000);
    pair.assert_agree("an SKR Pico");
    let drivers = pair.chip.execute(json!({ "drivers": true }))["drivers"].take();
    let counted = [(0, -1.0), (1, -1.0), (2, 1.0)]
        .map(|(index, sign)| sign * drivers[index]["position"].as_f64().expect("a count") / 256.0);
    assert_eq!(counted, pair.chip.motors, "the drivers' own count, full steps");
    let error = (pair.plant.ball() - Task::paper().target).norm();
    assert!(error < 0.010, "{error} m");
}

/// A circle of 5 cm at 5 cm/s, with a message before each picture.
#[test]
fn a_path_is_the_same_to_the_bit_with_every_law() {
    let Some(image) = firmware_image() else { return };
    let Point3 { coords: start } = Task::paper().start;
    let circle = |time: f64| {
        let (sin, cos) = time.sin_cos();
        Moment {
            position: Point3::from(start + 0.05 * Vector3::new(cos - 1.0, sin, 0.0)),
            velocity: 0.05 * Vector3::new(-sin, cos, 0.0),
            acceleration: 0.05 * Vector3::new(-cos, -sin, 0.0),
        }
    };
    for law in LawName::ALL {
        let mut rig = Rig::paper().expect("the paper's rig file");
        rig.law = law.into();
        let mut pair = Pair::new(Chip::start(&image), &Task::paper());
        pair.request(Command::Wire(rig.wiring().expect("a wiring")));
        pair.request(Command::Configure(rig.config().expect("a configuration")));
        pair.frame();
        let is_deferred = matches!(law, LawName::Adaptive | LawName::Taut);
        pair.acknowledged_after = Some(if is_deferred { u64::from(TICK_US) } else { 0 });
        for number in 1..=if is_long() { 90 } else { 45 } {
            let reached = pair.telemetry().reference;
            let time = reached.map_or(0.0, |reference| reference.time.0 as f64 * 1e-6);
            let first = (time / INTERVAL_S).floor() * INTERVAL_S;
            let message = reference(number, number % 2 == 0, time, first, circle);
            pair.request(Command::Follow(message));
            pair.frame();
        }
        assert_eq!(pair.state(), State::Following, "{law}");
        let moved = (pair.plant.ball() - Task::paper().start).norm();
        assert!(moved > 0.005, "{law}: {moved} m");
        pair.request(Command::Stop);
        pair.run(600_000);
        pair.assert_agree(law.as_str());
    }
}

/// Each kind of fault, four times in the long form.
#[test]
fn seeded_faults_are_the_same_to_the_bit() {
    faults(0..if is_long() { 20 } else { 5 }, |_| interval());
}

/// The same with the deferred laws, in turn: silence with one and a lost ball with the other, and
/// the other kinds in the long form.
#[test]
fn seeded_faults_are_the_same_to_the_bit_with_deferred_laws() {
    let deferred = |seed: u64| [LawName::Taut, LawName::Adaptive][seed as usize % 2];
    faults(20..if is_long() { 30 } else { 22 }, |seed| deferred(seed).into());
}

/// Compares both with a fault in the first second: silence, positions without a ball, noise, a
/// target or a ball outside the workspace.
fn faults(seeds: std::ops::Range<u64>, law: impl Fn(u64) -> LawSettings) {
    let Some(image) = firmware_image() else { return };
    for seed in seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut pair = seeking(&image, law(seed));
        for _ in 0..random.random_range(3..20) {
            pair.frame();
        }
        match seed % 5 {
            0 => pair.run(700_000),
            1 => (0..20).for_each(|_| {
                pair.request(Command::Position(Position {
                    sequence: pair.sequence,
                    age_us: 0,
                    ball: None,
                    covariance: None,
                }));
                pair.run(30_000);
            }),
            2 => {
                let noise: Vec<u8> =
                    (0..random.random_range(20..60)).map(|_| random.random()).collect();
                pair.send(&[noise.as_slice(), &[0]].concat());
                pair.frame();
            }
            3 => {
                pair.request(Command::Target(Point::from_metres([0.4, 0.4, 2.0]).expect("a point")))
            }
            _ => (0..5).for_each(|_| {
                pair.sequence += 1;
                let ball = Point::from_metres([0.4, 0.4, random.random_range(1.0..3.0)]);
                pair.request(Command::Position(Position {
                    sequence: pair.sequence,
                    age_us: 0,
                    ball,
                    covariance: None,
                }));
                pair.run(30_000);
            }),
        }
        pair.request(Command::Stop);
        // A ramp of 0.2 s, and the moving average of law `taut`.
        pair.run(600_000);
        pair.assert_agree(&format!("seed {seed}"));
    }
}
