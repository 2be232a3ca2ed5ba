//! Commands and their effects.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use plumb_core::{Outbox, TICK_US};
use plumb_protocol::Config;
use plumb_protocol::frame::encode;
use plumb_protocol::message::*;
use plumb_protocol::units::{Micrometres, Micros, Milliseconds, Rate, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{BUILD, config};

#[test]
fn nothing_moves_before_the_greeting_matches() {
    let mut bench = Bench::new(BUILD);
    assert_eq!(bench.send(Command::Configure(config())), Err(Refusal::NotGreeted));
    assert_eq!(bench.send(Command::Status), Err(Refusal::NotGreeted));
    let wrong = [
        Hello { magic: *b"PLMC", ..Hello::OURS },
        Hello { version: VERSION + 1, ..Hello::OURS },
        Hello { schema: [0; 8], ..Hello::OURS },
    ];
    for hello in wrong {
        let _ = bench.send(Command::Hello(hello));
        let [.., FromBoard::Hello(answer), FromBoard::Provenance(_)] = bench.received[..] else {
            panic!("{:?}", bench.received)
        };
        assert!(!answer.accepted && answer.hello == Hello::OURS);
        assert_eq!(bench.send(Command::Target(point(TARGET))), Err(Refusal::NotGreeted));
    }
    assert_eq!(bench.send(Command::Stop), Ok(()));
    bench.run_ms(1000);
    assert_eq!(bench.harness.board.positions(), [0; 3]);
}

#[test]
fn a_hello_of_another_version_stops_the_motors() {
    let mut bench = Bench::seeking();
    assert!(bench.moving());
    let _ = bench.send(Command::Hello(Hello { version: VERSION + 1, ..Hello::OURS }));
    bench.run_ms(210);
    assert!(!bench.moving());
    assert_eq!(bench.harness.board.state(), State::Ready);
}

#[test]
fn an_unconfigured_board_refuses_to_move() {
    let mut bench = Bench::greeted(BUILD);
    let jog = Jog { motor: 0, distance: Steps16(160), rate: Rate(256) };
    for command in [Command::Target(point(TARGET)), Command::Hold, Command::Jog(jog)] {
        assert_eq!(bench.send(command), Err(Refusal::Unconfigured));
    }
    assert_eq!(bench.send_position(Some(BALL), 0), Err(Refusal::Unconfigured));
    assert_eq!(bench.harness.board.state(), State::Unconfigured);
}

#[test]
fn a_target_is_sought_and_held() {
    let mut bench = Bench::seeking();
    assert!(bench.moving());
    // The ball jumps to the target.
    bench.run_with_ball(9, TARGET);
    assert_eq!(bench.harness.board.state(), State::Seeking, "after a few positions");
    bench.run_with_ball(40, TARGET);
    assert_eq!(bench.harness.board.state(), State::Holding);
    assert!(bench.faults().is_empty());
    assert_eq!(bench.send(Command::Stop), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Ready);
}

#[test]
fn a_single_position_near_the_target_is_no_arrival() {
    let mut bench = Bench::seeking();
    for _ in 0..20 {
        bench.run_with_ball(1, TARGET);
        bench.run_with_ball(4, [0.41, 0.42, 0.15]);
    }
    assert_eq!(bench.harness.board.state(), State::Seeking);
}

#[test]
fn positions_out_of_order_are_refused_and_numbers_wrap() {
    let mut bench = Bench::configured(config());
    let mut position = |sequence| {
        bench.received.clear();
        bench.send(Command::Position(Position {
            sequence,
            age_us: 0,
            ball: Some(point(BALL)),
            covariance: None,
        }))
    };
    assert_eq!(position(65_530), Ok(()));
    assert_eq!(position(65_530), Err(Refusal::PositionOutOfOrder));
    assert_eq!(position(65_529), Err(Refusal::PositionOutOfOrder));
    assert_eq!(position(3), Ok(()));
    assert_eq!(position(65_535), Err(Refusal::PositionOutOfOrder));
}

#[test]
fn hold_keeps_the_ball_where_it_is() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send(Command::Hold), Err(Refusal::NoPosition));
    bench.run_with_ball(10, BALL);
    assert_eq!(bench.send(Command::Hold), Ok(()));
    bench.run_with_ball(10, BALL);
    assert_eq!(bench.harness.board.state(), State::Holding);
    assert_eq!(bench.harness.board.positions(), [0; 3]);
}

#[test]
fn a_jog_turns_one_motor_and_is_bounded() {
    let mut bench = Bench::configured(config());
    let jog = |motor, steps: i32, rate| {
        Command::Jog(Jog { motor, distance: Steps16(16 * steps), rate: Rate(rate) })
    };
    assert_eq!(bench.send(jog(3, 10, 256)), Err(Refusal::NoSuchMotor));
    assert_eq!(bench.send(jog(0, 10, 0)), Err(Refusal::JogRate));
    assert_eq!(bench.send(jog(0, 10, 401 * 256)), Err(Refusal::JogRate));
    assert_eq!(bench.send(jog(0, 4001, 256)), Err(Refusal::JogTravel));
    assert_eq!(bench.send(jog(1, -20, 100 * 256)), Ok(()));
    bench.run_ms(100);
    assert_eq!(bench.send(jog(1, 20, 256)), Err(Refusal::Busy(State::Jogging)));
    bench.run_ms(180);
    assert_eq!(bench.send(Command::Status), Ok(()));
    bench.run_ms(200);
    assert_eq!(bench.harness.board.positions(), [0, -16 * 20, 0]);
    // The host's silence stops a long jog.
    assert_eq!(bench.send(jog(1, 2000, 100 * 256)), Ok(()));
    bench.run_ms(302);
    bench.assert_stopped_by(Fault::HostSilent);
}

#[test]
fn the_pulses_of_a_tick_move_the_motor() {
    let mut bench = Bench::configured(config());
    let jog = Jog { motor: 1, distance: Steps16(16 * 5), rate: Rate(40 << 8) };
    assert_eq!(bench.send(Command::Jog(jog)), Ok(()));
    let (mut counted, per_pulse) = (0, 16 / i32::from(config().microsteps));
    while bench.harness.board.state() != State::Ready {
        bench.tick();
        let pulses = &bench.harness.board.pulses().motors;
        counted += i32::from(pulses[1].count) * per_pulse;
        assert_eq!((bench.harness.board.positions()[1], pulses[0].count), (counted, 0));
    }
    assert_eq!(counted, 16 * 5);
}

#[test]
fn a_drive_refuses_configurations_and_jogs() {
    let mut bench = Bench::seeking();
    assert_eq!(bench.send(Command::Configure(config())), Err(Refusal::Busy(State::Seeking)));
    let jog = Jog { motor: 0, distance: Steps16(16), rate: Rate(256) };
    assert_eq!(bench.send(Command::Jog(jog)), Err(Refusal::Busy(State::Seeking)));
    // The ramp down after Stop refuses them too.
    assert_eq!(bench.send(Command::Stop), Ok(()));
    assert!(bench.moving());
    assert_eq!(bench.send(Command::Configure(config())), Err(Refusal::Busy(State::Stopping)));
}

/// A moving average stretches the end of the ramp: the rates are rounded to 0 before the motors
/// stand.
#[test]
fn a_stop_ends_in_ready_once_the_motors_stand() {
    let mut bench = Bench::configured(Config { mean: Milliseconds(400), ..config() });
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(20, BALL);
    assert_eq!(bench.send(Command::Stop), Ok(()));
    let mut slow = 0;
    while bench.harness.board.state() == State::Stopping {
        assert_eq!(bench.send(Command::Configure(config())), Err(Refusal::Busy(State::Stopping)));
        bench.tick();
        slow += u32::from(!bench.moving() && bench.harness.board.state() == State::Stopping);
    }
    assert!(slow > 0);
    assert_eq!(bench.harness.board.state(), State::Ready);
    let rest = bench.harness.board.positions();
    bench.run_ms(100);
    assert_eq!(bench.harness.board.positions(), rest);
    assert_eq!(bench.send(Command::Configure(config())), Ok(()));
}

#[test]
fn the_bootloader_waits_for_standstill() {
    let mut bench = Bench::seeking();
    assert_eq!(bench.send(Command::Bootloader), Ok(()));
    for _ in 0..1500 {
        let tick = bench.harness.tick(Micros(bench.now)).unwrap();
        bench.now += u64::from(TICK_US);
        assert_eq!(tick.bootloader, !bench.moving());
        if tick.bootloader {
            return;
        }
    }
    panic!("the board never comes to rest");
}

#[test]
fn a_configuration_out_of_range_is_refused_with_its_field() {
    let mut cases: Vec<(ConfigField, Config)> = Vec::new();
    let mut case = |field, change: &dyn Fn(&mut Config)| {
        let mut config = config();
        change(&mut config);
        cases.push((field, config));
    };
    fn law(c: &mut Config) -> &mut plumb_protocol::config::Interval {
        let plumb_protocol::config::Law::Interval(law) = &mut c.law else {
            panic!("the law of these tests")
        };
        law
    }
    case(ConfigField::Signs, &|c| law(c).signs[1][1] = 2);
    case(ConfigField::Signs, &|c| law(c).signs = [[1, 0, 1].into(); 3]);
    case(ConfigField::Bounds, &|c| law(c).alpha[2][0].0 = 0);
    case(ConfigField::Bounds, &|c| law(c).alpha[0][1].0 = 40_000);
    case(ConfigField::Bounds, &|c| law(c).beta[0][1].0 = u32::MAX);
    case(ConfigField::Gain, &|c| law(c).gain.0 = 0);
    case(ConfigField::Gain, &|c| law(c).gain.0 = u32::MAX);
    case(ConfigField::MaxRate, &|c| c.motors[1].max_rate = Rate(0));
    case(ConfigField::MaxRate, &|c| c.motors[1].max_rate = Rate(-5));
    case(ConfigField::MaxRate, &|c| c.motors[2].max_rate = Rate(i32::MAX));
    case(ConfigField::MaxAcceleration, &|c| c.motors[0].max_acceleration.0 = 39);
    case(ConfigField::MaxAcceleration, &|c| c.motors[0].max_acceleration.0 = u32::MAX);
    case(ConfigField::Travel, &|c| c.motors[0].travel_min = Steps16(1));
    case(ConfigField::Travel, &|c| c.motors[0].travel_max = Steps16(i32::MAX));
    case(ConfigField::Microsteps, &|c| c.microsteps = 3);
    case(ConfigField::Microsteps, &|c| c.microsteps = 0);
    case(ConfigField::Workspace, &|c| c.workspace.min = c.workspace.max);
    case(ConfigField::Workspace, &|c| c.workspace.max.0[2] = Micrometres(i32::MAX));
    case(ConfigField::Workspace, &|c| c.workspace.min.0[0] = Micrometres(i32::MIN));
    case(ConfigField::Reached, &|c| c.reached.radius = Micrometres(0));
    case(ConfigField::Reached, &|c| c.reached.frames = 0);
    case(ConfigField::Deadlines, &|c| c.deadlines.host.0 = 0);
    case(ConfigField::Deadlines, &|c| c.deadlines.position.0 = u16::MAX);
    case(ConfigField::Deadlines, &|c| c.deadlines.max_age.0 = 0);
    case(ConfigField::MaxAge, &|c| c.deadlines.max_age = c.deadlines.position);
    case(ConfigField::MaxAge, &|c| c.deadlines.max_age.0 = 5_000);
    case(ConfigField::Growth, &|c| c.growth.margin = Micrometres(-1));
    case(ConfigField::Growth, &|c| c.growth.time.0 = 0);
    case(ConfigField::Growth, &|c| c.growth.margin.0 = 1_000_001);
    case(ConfigField::Growth, &|c| c.growth.time.0 = 5_001);
    case(ConfigField::Following, &|c| c.following.turn = Steps16(0));
    case(ConfigField::Following, &|c| c.following.turn = Steps16(1_600_001));
    case(ConfigField::Following, &|c| c.following.movement.0 = 4_999);
    case(ConfigField::Following, &|c| c.following.movement.0 = 1_000_001);
    case(ConfigField::Progress, &|c| c.progress.margin.0 = 0);
    case(ConfigField::Progress, &|c| c.progress.margin.0 = 1_000_001);
    case(ConfigField::Progress, &|c| c.progress.time.0 = 0);
    case(ConfigField::Progress, &|c| c.progress.time.0 = 60_001);
    case(ConfigField::Jog, &|c| c.jog.max_rate = Rate(0));
    case(ConfigField::Jog, &|c| c.jog.max_distance = Steps16(0));
    case(ConfigField::Jog, &|c| c.jog.max_distance = Steps16(i32::MAX));
    let mut bench = Bench::greeted(BUILD);
    for (field, config) in cases {
        assert_eq!(
            bench.send(Command::Configure(config)),
            Err(Refusal::Config(field)),
            "{config:?}"
        );
        assert_eq!(bench.harness.board.state(), State::Unconfigured);
    }
}

#[test]
fn torn_and_unknown_frames_are_counted_and_an_unknown_command_is_answered() {
    let mut bench = Bench::seeking();
    bench.harness.receive(Micros(bench.now), &[9, 1, 0, 3, 2, 0]);
    assert!(bench.harness.outbox.bytes().is_empty());
    let unknown = encode(&(3u16, 99u8)).unwrap();
    bench.harness.receive(Micros(bench.now), &unknown);
    bench.collect();
    let Some(FromBoard::Answer(answer)) = bench.received.last() else {
        panic!("{:?}", bench.received)
    };
    assert_eq!((answer.id, answer.refusal), (3, Some(Refusal::Malformed)));
    let _ = bench.send(Command::Status);
    let telemetry = bench.received.iter().rev().find_map(|m| match m {
        FromBoard::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    assert_eq!(telemetry.unwrap().bad_frames, 3);
}

#[test]
fn a_full_outbox_does_not_stop_the_board() {
    let mut bench = Bench::seeking();
    let mut unread = Outbox::new();
    for _ in 0..100 {
        let message = ToBoard { id: 1, command: Command::Status };
        let status = Request { message, crc: 0 };
        bench.harness.board.on_frame(Micros(bench.now), Ok(&status), &mut unread);
    }
    assert!(unread.dropped() > 0);
    bench.run_with_ball(10, BALL);
    assert_eq!(bench.harness.board.state(), State::Seeking);
}
