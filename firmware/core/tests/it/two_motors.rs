//! Two motors: what a board takes and refuses, and where its two cables lead the ball.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use plumb_core::law::{InlineLaw, LawSelection, MotorRates};
use plumb_core::params::Params;
use plumb_emulator::plant::{PlanarPopulation, Plant, QuasiStatic};
use plumb_protocol::config::{Estimated, Interval, Law, Motor, Sign, Workspace};
use plumb_protocol::message::*;
use plumb_protocol::units::{
    Bound, Gain, Micrometres, Milliseconds, Point, Rate, SignGain, Steps16,
};
use plumb_protocol::wiring::{Pen, WiringError};
use plumb_protocol::{Config, MotorList, Wiring};

use super::common::bench::{Bench, point};
use super::common::{BUILD, config, motor, wiring};

/// Place and target of the ball, metres.
const BALL: [f64; 3] = [0.0, 0.3, 0.3];
const TARGET: [f64; 3] = [0.0, 0.4, 0.25];

fn two() -> Wiring {
    wiring().of_motors(2)
}

/// Returns a configuration of two motors with the law `sign`.
fn planar() -> Config {
    let corner = |y, z| Point([0, y, z].map(Micrometres));
    Config {
        law: Law::Sign(Sign { gain: SignGain(2225) }),
        motors: [motor(400.0, 2000, 16 * 4000); 2].into(),
        workspace: Workspace {
            min: corner(-1_000_000, -1_000_000),
            max: corner(2_000_000, 600_000),
        },
        ..config()
    }
}

/// Returns the answers to this wiring and this configuration.
fn answer(wiring: Wiring, config: Config) -> Result<(), Refusal> {
    let mut bench = Bench::greeted(BUILD);
    bench.send(Command::Wire(wiring))?;
    bench.send(Command::Configure(config))
}

#[test]
fn a_board_takes_two_motors_and_three_in_turn() {
    let mut bench = Bench::wired(two(), planar());
    let count = |bench: &mut Bench| {
        bench.received.clear();
        assert_eq!(bench.send(Command::Status), Ok(()));
        bench.received.iter().find_map(|message| match message {
            FromBoard::Telemetry(told) => Some((told.motors.len(), told.rates.len())),
            _ => None,
        })
    };
    assert_eq!(count(&mut bench), Some((2, 2)));
    assert_eq!(bench.send(Command::Wire(wiring())), Ok(()));
    assert_eq!(bench.send(Command::Configure(config())), Ok(()));
    assert_eq!(count(&mut bench), Some((3, 3)));
}

#[test]
fn other_numbers_of_motors_are_refused() {
    let of = |motors: MotorList<Motor>| Config { motors, ..planar() };
    let one = motor(400.0, 2000, 100);
    let refused = Err(Refusal::Config(ConfigField::Motors));
    assert_eq!(answer(two(), of([one].into())), refused);
    assert_eq!(answer(two(), of([one; 4].into())), refused);
    assert_eq!(answer(two(), of([one; 3].into())), refused, "not as many as are wired");
    assert_eq!(answer(wiring(), planar()), refused, "not as many as are wired");
    let wired = |change: &dyn Fn(&mut Wiring)| {
        let mut wiring = two();
        change(&mut wiring);
        answer(wiring, planar())
    };
    let refused = |error| Err(Refusal::Wiring(error));
    let pins = wiring().pins.motors;
    let four = MotorList::new([pins[0], pins[1], pins[2], pins[2]]);
    assert_eq!(wired(&|it| it.pins.motors = four), refused(WiringError::Motors));
    assert_eq!(wired(&|it| it.pins.motors = pins.up_to(1)), refused(WiringError::Motors));
    let pen = Pen { pin: 20, ..Pen::default() };
    assert_eq!(wired(&|it| it.pins.pen = Some(pen)), refused(WiringError::Pen));
}

#[test]
fn a_plane_needs_its_own_law_and_workspace() {
    let field = |config: Config| match answer(two(), config) {
        Err(Refusal::Config(field)) => Some(field),
        _ => None,
    };
    let taut = Law::Taut(Estimated { delay: Milliseconds(0) });
    assert_eq!(field(Config { law: taut, ..planar() }), Some(ConfigField::Law));
    let wide =
        Workspace { max: Point([1, 2_000_000, 600_000].map(Micrometres)), ..planar().workspace };
    assert_eq!(field(Config { workspace: wide, ..planar() }), Some(ConfigField::Workspace));
    let family = Interval::planar(Bound(328), Bound(1 << 15), Gain(4172));
    let with = |law: Interval| field(Config { law: Law::Interval(law), ..planar() });
    assert_eq!(with(family), None);
    let of_three = Interval::uniform(Bound(328), Bound(1 << 15), Gain(4172));
    assert_eq!(with(of_three), Some(ConfigField::Signs));
    let short = [family.alpha[0], family.alpha[1].up_to(1), family.alpha[2]];
    assert_eq!(with(Interval { alpha: short, ..family }), Some(ConfigField::Signs));
    let mut across = family;
    across.signs[0][1] = 1;
    assert_eq!(with(across), Some(ConfigField::Signs));
}

#[test]
fn a_motor_that_the_rig_has_not_stays_where_it_is() {
    let mut bench = Bench::wired(two(), planar());
    let jog = Command::Jog(Jog { motor: 2, distance: Steps16(160), rate: Rate(256) });
    assert_eq!(bench.send(jog), Err(Refusal::NoSuchMotor));
    for law in [
        Law::Sign(Sign { gain: SignGain(2225) }),
        Law::Interval(Interval::planar(Bound(328), Bound(1 << 15), Gain(4172))),
        Law::Adaptive(Estimated { delay: Milliseconds(5) }),
    ] {
        let mut bench = Bench::wired(two(), Config { law, ..planar() });
        bench.send_ball(BALL);
        assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
        bench.run_with_ball(20, BALL);
        let [a, b, c] = bench.harness.board.positions();
        assert!((a != 0 || b != 0) && c == 0, "{law:?}: {a} {b} {c}");
    }
}

/// A board keeps where motor C stands while a rig of two is wired, outside any travel.
#[test]
fn a_third_motor_far_out_does_not_hold_up_two() {
    let mut bench = Bench::configured(config());
    let jog = Jog { motor: 2, distance: Steps16(16 * 3000), rate: Rate(400 << 8) };
    assert_eq!(bench.send(Command::Jog(jog)), Ok(()));
    for _ in 0..90 {
        assert_eq!(bench.send(Command::Status), Ok(()));
        bench.run_ms(100);
    }
    assert_eq!(bench.harness.board.positions()[2], 16 * 3000);
    assert_eq!(bench.send(Command::Wire(two())), Ok(()));
    let motors = [motor(400.0, 2000, 16 * 1000); 2].into();
    assert_eq!(bench.send(Command::Configure(Config { motors, ..planar() })), Ok(()));
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(5, BALL);
    assert_eq!(bench.harness.board.state(), State::Seeking);
}

#[test]
fn commands_of_a_later_version_are_refused_by_name() {
    let mut bench = Bench::configured(config());
    let rates = Rates { sequence: 1, rates: [Rate(256); 3].into(), valid_us: 100_000 };
    for command in [Command::Rates(rates), Command::Pen(PenPosition::Down)] {
        assert_eq!(bench.send(command), Err(Refusal::Unsupported), "{command:?}");
    }
    assert_eq!(bench.harness.board.rates(), [0; 3]);
}

/// The theorem of docs/understand/sign.md: with two cables |e| falls from every place, whatever the
/// rig is.
#[test]
fn the_sign_law_leads_nearer_from_every_place_of_a_thousand_rigs() {
    let params = Params::check(&planar(), &two().drivers, &BUILD).unwrap();
    let population = PlanarPopulation::default();
    for index in 0..1000 {
        let task = population.sample(3, index).unwrap();
        let LawSelection::Inline(InlineLaw::Sign(mut law)) = params.law() else {
            panic!("the law of this test")
        };
        let um = |metres: f64| (metres * 1e6) as i32;
        let error = |i: usize| um(task.start[i]) - um(task.target[i]);
        let MotorRates(rates) = law.rates([0, 1, 2].map(error)).within([256 * 40; 3]);
        let mut plant = QuasiStatic::new(task.geometry, task.start).unwrap();
        let before = (plant.ball() - task.target).norm();
        // A hundredth of a second.
        plant.advance(0.01, rates.map(|rate| f64::from(rate) / 25_600.0)).unwrap();
        let after = (plant.ball() - task.target).norm();
        assert!(after < before && rates[2] == 0, "rig {index}: {before} to {after}");
    }
}
