//! Deferred laws: requests and responses, and when responses take effect.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::TICK_US;
use plumb_core::law::{DeferredLawKind, LawTicks, variances};
use plumb_core::law_worker::LawRequest;
use plumb_emulator::LawDelay;
use plumb_protocol::Config;
use plumb_protocol::config::{Deadlines, Estimated, Law};
use plumb_protocol::message::{Command, Fault, State};
use plumb_protocol::units::{Covariance, Milliseconds};

use crate::common::bench::{BALL, TARGET, point};
use crate::common::config;
use crate::common::deferred_bench::DeferredBench;

const DELAY: Estimated = Estimated { delay: Milliseconds(0) };

/// Returns the ticks after which a law of the bench's board responds.
fn ticks(law: DeferredLawKind) -> u32 {
    let ticks = match law {
        DeferredLawKind::Adaptive => LawTicks::RP2040.adaptive,
        DeferredLawKind::Taut => LawTicks::RP2040.taut,
    };
    ticks.standing.into()
}

fn deferred(law: fn(Estimated) -> Law) -> Config {
    Config { law: law(DELAY), ..config() }
}

#[test]
fn a_response_takes_effect_in_its_tick_however_early_it_comes() {
    for (law, kind) in [
        (Law::Adaptive as fn(_) -> _, DeferredLawKind::Adaptive),
        (Law::Taut, DeferredLawKind::Taut),
    ] {
        let [early, late] = [1, ticks(kind)].map(|takes| {
            DeferredBench::seeking(deferred(law), LawDelay::Ticks(takes)).run_with_ball(60)
        });
        assert_eq!(early, late, "{kind:?}");
        assert!(early.last().unwrap().iter().any(|p| p.abs() > 1000), "{kind:?} moves");
        let mut bench = DeferredBench::seeking(deferred(law), LawDelay::Ticks(1));
        bench.send_ball(BALL);
        bench.run(ticks(kind));
        assert!(bench.still() && bench.requests.len() == 1, "{kind:?}: not before its tick");
        bench.run(1);
        assert!(!bench.still(), "{kind:?}: in its tick");
    }
}

#[test]
fn a_response_at_once_gives_the_same_motion() {
    let mut bench =
        DeferredBench::seeking(deferred(Law::Taut), LawDelay::Ticks(ticks(DeferredLawKind::Taut)));
    let chip = bench.run_with_ball(30);
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), LawDelay::SameTick);
    let mut host = Vec::new();
    for k in 0..30 {
        let part = f64::from(k) / 50.0;
        bench.send_ball([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
        for tick in 1..=165 {
            bench.run(1);
            host.extend((tick % 5 == 0).then(|| bench.harness.board.positions()));
        }
    }
    assert_eq!(host, chip);
}

/// Runs pictures of a ball that follows. Returns the motor positions of every tick.
fn follow(bench: &mut DeferredBench, pictures: u32) -> Vec<[i32; 3]> {
    let mut past = Vec::new();
    for _ in 0..pictures {
        let ball = bench.ball();
        bench.send_ball(ball);
        for _ in 0..165 {
            bench.run(1);
            past.push(bench.harness.board.positions());
        }
    }
    past
}

#[test]
fn the_delay_of_a_law_counts_beyond_the_age_of_a_position() {
    for delay_ms in [0, 100] {
        let law = Law::Taut(Estimated { delay: Milliseconds(delay_ms) });
        let mut bench = DeferredBench::seeking(Config { law, ..config() }, LawDelay::Ticks(1));
        let past = follow(&mut bench, 20);
        let &(tick, request) = bench.requests.last().unwrap();
        // Positions come every 165 ticks, 30 ms old.
        let captured = tick / 165 * 165 - 150 - u64::from(delay_ms) * 5;
        let expected = past[captured as usize - 1];
        let later = past[captured as usize + 99];
        let moved: i32 = (0..3).map(|i| (later[i] - expected[i]).abs()).sum();
        assert!(moved > 50, "{moved}");
        let off = (0..3).map(|i| (request.measurement.motors[i] - expected[i]).abs());
        assert!(off.max().unwrap() <= 3, "{request:?} {expected:?}");
    }
}

/// The board waits for the end of a setpoint: it does not find it with the next message.
#[test]
fn a_setpoint_ends_in_its_tick() {
    let due = ticks(DeferredLawKind::Adaptive);
    let ended = (10..60).filter(|pictures| {
        let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), LawDelay::Ticks(1));
        follow(&mut bench, *pictures);
        let &(made, _) = bench.requests.last().unwrap();
        let valid_us = bench.responses.last().unwrap().setpoint.valid_us;
        let end = made + u64::from(due) + u64::from(valid_us.div_ceil(TICK_US));
        let rates = bench.harness.board.rates();
        // The motors turn at constant rates. The positions are missed later, after 200 ms.
        bench.run(2);
        if bench.harness.board.rates() != rates || !(bench.tick + 5..made + 800).contains(&end) {
            return false;
        }
        while bench.tick < end {
            assert_eq!(bench.harness.board.rates(), rates, "{} before {end}", bench.tick);
            bench.run(1);
        }
        bench.run(1);
        assert_ne!(bench.harness.board.rates(), rates, "tick {end}");
        true
    });
    assert!(ended.count() > 2);
}

#[test]
fn tensions_are_in_the_telemetry_from_the_first_response_of_taut_until_the_stop() {
    let due = ticks(DeferredLawKind::Taut);
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), LawDelay::Ticks(1));
    bench.send_ball(BALL);
    bench.run(due);
    assert_eq!(bench.telemetry().tensions, None, "the response has no effect yet");
    bench.run(1);
    let tensions = bench.telemetry().tensions.unwrap();
    assert!(tensions.iter().all(|t| (0.05..3.0).contains(&t.to_si())), "{tensions:?}");
    bench.send(Command::Target(point(BALL)));
    assert_eq!(bench.telemetry().tensions, Some(tensions), "they are the rig's, not the target's");
    bench.send(Command::Stop);
    assert_eq!(bench.telemetry().tensions, None, "without a target");
    bench.run(3000);
    bench.send(Command::Target(point(TARGET)));
    assert_eq!(bench.telemetry().tensions, None, "another drive");
    bench.run_with_ball(2);
    assert_ne!(bench.telemetry().tensions, None);
}

#[test]
fn a_law_without_an_estimate_sends_no_tensions() {
    let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), LawDelay::Ticks(1));
    bench.run_with_ball(3);
    assert!(!bench.still());
    assert_eq!(bench.telemetry().tensions, None);
}

#[test]
fn a_missing_response_stops_the_board() {
    let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), LawDelay::Ticks(1));
    bench.run_with_ball(20);
    assert!(!bench.still());
    bench.harness.law_delay = LawDelay::Ticks(ticks(DeferredLawKind::Adaptive) + 1);
    bench.harness.outbox.clear();
    bench.send_ball(BALL);
    bench.run(ticks(DeferredLawKind::Adaptive) + 1);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::LawLate));
    assert!(bench.has_reported(Fault::LawLate));
    bench.run(2000);
    assert!(bench.still());
}

#[test]
fn another_target_or_a_stop_voids_the_response() {
    for command in [Command::Target(point(BALL)), Command::Stop, Command::Hold] {
        for takes in [LawDelay::Ticks(3), LawDelay::Never] {
            let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), takes);
            bench.send_ball(BALL);
            bench.run(2);
            bench.send(command);
            bench.run(1000);
            assert!(bench.still(), "{command:?}");
            assert_ne!(bench.harness.board.state(), State::Fault(Fault::LawLate), "{command:?}");
        }
    }
}

#[test]
fn the_newest_position_waits_while_a_request_is_open() {
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), LawDelay::Ticks(5));
    for z in [0.40, 0.39, 0.38] {
        bench.send_ball([0.5, 0.3, z]);
        bench.run(10);
    }
    bench.run(ticks(DeferredLawKind::Taut));
    let seen: Vec<_> =
        bench.requests.iter().map(|(tick, q)| (*tick, q.number, q.measurement.ball[2])).collect();
    assert_eq!(seen, [(0, 1, 400_000), (u64::from(ticks(DeferredLawKind::Taut)), 2, 380_000)]);
}

#[test]
fn the_waiting_position_gets_the_present_target_and_a_stop_discards_it() {
    for (command, count) in [(Command::Target(point(BALL)), 2), (Command::Stop, 1)] {
        let mut bench = DeferredBench::seeking(deferred(Law::Taut), LawDelay::Ticks(5));
        bench.send_ball(BALL);
        bench.run(10);
        bench.send_ball(BALL);
        bench.send(command);
        bench.run(10);
        bench.send(Command::Target(point(BALL)));
        bench.run(ticks(DeferredLawKind::Taut));
        assert_eq!(bench.requests.len(), count, "{command:?}");
        let (_, request) = bench.requests.last().unwrap();
        let target = if count == 2 { BALL } else { TARGET };
        assert_eq!(request.measurement.target, point(target).micrometres());
    }
}

#[test]
fn a_configuration_makes_the_law_anew_and_a_target_does_not() {
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), LawDelay::Ticks(5));
    let made_for = |bench: &DeferredBench| {
        bench.requests.iter().map(|(_, q)| q.generation).collect::<Vec<_>>()
    };
    bench.run_with_ball(2);
    bench.send(Command::Target(point(BALL)));
    bench.run_with_ball(1);
    assert_eq!(made_for(&bench), [1, 1, 1]);
    bench.send(Command::Stop);
    bench.run(3000);
    bench.send(Command::Configure(deferred(Law::Adaptive)));
    bench.send(Command::Target(point(TARGET)));
    bench.run_with_ball(2);
    assert_eq!(made_for(&bench), [1, 1, 1, 2, 2]);
    assert_eq!(bench.requests[4].1.kind, DeferredLawKind::Adaptive);
}

#[test]
fn the_covariance_of_a_position_reaches_the_law() {
    let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), LawDelay::Ticks(5));
    bench.send_ball(BALL);
    bench.run(20);
    bench.send_covariance(
        BALL,
        Some(Covariance { variances: [900, 1, u16::MAX], covariances: [0; 3] }),
    );
    bench.run(20);
    let variances: Vec<[i32; 3]> =
        bench.requests.iter().map(|(_, request)| request.measurement.variances).collect();
    assert_eq!(variances, [[4_000_000, 1_000_000, 1_000_000], [9_490_000, 500_000, 655_840_000]]);
}

/// No position comes for 400 ms, in which the last rates would bring the ball to its target twice.
#[test]
fn the_motors_go_no_farther_than_the_steps_that_were_left() {
    let deadlines = Deadlines { host: Milliseconds(1_000), ..config().deadlines };
    for last_mm in [60.0, 30.0, 15.0] {
        let config = Config { deadlines, ..deferred(Law::Adaptive) };
        let mut bench = DeferredBench::seeking(config, LawDelay::Ticks(5));
        let away_mm = |bench: &DeferredBench| {
            let ball = bench.ball();
            1e3 * (0..3).map(|i| (ball[i] - TARGET[i]).powi(2)).sum::<f64>().sqrt()
        };
        while away_mm(&bench) > last_mm {
            bench.send_ball(bench.ball());
            bench.run(165);
        }
        let before = away_mm(&bench);
        bench.run(2000 - 165);
        assert!(bench.still(), "{last_mm} mm");
        assert!(away_mm(&bench) < 0.3 * before, "{before} mm, {} mm later", away_mm(&bench));
    }
}

#[test]
fn a_law_follows_an_uncertain_position_less() {
    for law in [Law::Adaptive, Law::Taut] {
        let mut bench = DeferredBench::seeking(deferred(law), LawDelay::Ticks(5));
        for _ in 0..20 {
            bench.send_ball(bench.ball());
            bench.run(165);
        }
        let (_, request) = bench.requests[bench.requests.len() - 1];
        let response = |off_um: i32, variance: u16| {
            let mut measurement = request.measurement;
            measurement.ball[0] += off_um;
            measurement.variances =
                variances(Some(Covariance { variances: [variance; 3], covariances: [0; 3] }));
            bench
                .harness
                .law_worker
                .clone()
                .respond(&LawRequest { measurement, ..request })
                .setpoint
                .rates
                .0
        };
        let moved = |variance| -> i32 {
            let (there, off) = (response(0, variance), response(4000, variance));
            (0..3).map(|k| (there[k] - off[k]).abs()).sum()
        };
        // Standard deviations of 1 mm and of 10 mm.
        assert!(2 * moved(10_000) < moved(100), "{} {}", moved(10_000), moved(100));
        assert!(moved(10_000) > 0);
    }
}
