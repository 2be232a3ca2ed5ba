//! Deferred laws: requests and responses, and when responses take effect.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

mod common;

use common::bench::{BALL, TARGET, point};
use common::{BUILD, config};
use plumb_core::law::{DeferredLawKind, variances};
use plumb_core::law_worker::LawRequest;
use plumb_core::{Board, LawWorker, Outbox, TICK_US};
use plumb_protocol::Config;
use plumb_protocol::config::{Deadlines, Estimated, Law};
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Position, State, ToBoard};
use plumb_protocol::units::{Covariance, Micros, Milliseconds};

const DELAY: Estimated = Estimated { delay: Milliseconds(0) };

/// A board, and a law worker that takes some ticks to respond.
struct DeferredBench {
    board: Board,
    law_worker: LawWorker,
    /// Ticks from a request to its response; `None` where no response comes.
    takes: Option<u32>,
    open: Option<(LawRequest, u32)>,
    /// Requests so far, with their ticks.
    requests: Vec<(u64, LawRequest)>,
    tick: u64,
    out: Outbox,
    sequence: u16,
    id: u16,
}

fn deferred(law: fn(Estimated) -> Law) -> Config {
    Config { law: law(DELAY), ..config() }
}

impl DeferredBench {
    /// Creates a board that seeks a target and has no position yet.
    fn seeking(config: Config, takes: Option<u32>) -> Self {
        let mut bench = Self {
            board: Board::new(BUILD),
            law_worker: LawWorker::new(),
            takes,
            open: None,
            requests: Vec::new(),
            tick: 0,
            out: Outbox::new(),
            sequence: 0,
            id: 0,
        };
        for command in [
            Command::Hello(Hello::OURS),
            Command::Configure(config),
            Command::Target(point(TARGET)),
        ] {
            bench.send(command);
        }
        bench
    }

    fn now(&self) -> Micros {
        Micros(self.tick * u64::from(TICK_US))
    }

    fn send(&mut self, command: Command) {
        self.id += 1;
        let frame = encode(&ToBoard { id: self.id, command }).unwrap();
        self.board.receive(self.now(), &frame, &mut self.out);
    }

    fn send_ball(&mut self, ball: [f64; 3]) {
        self.send_covariance(ball, None);
    }

    fn send_covariance(&mut self, ball: [f64; 3], covariance: Option<Covariance>) {
        self.sequence += 1;
        let (sequence, ball) = (self.sequence, Some(point(ball)));
        self.send(Command::Position(Position { sequence, age_us: 30_000, ball, covariance }));
    }

    /// Runs ticks in the chip's order: a response that has come, the plan, the next request.
    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            if let Some((request, left)) = &mut self.open {
                *left -= 1;
                if *left == 0 {
                    let response = self.law_worker.respond(request);
                    self.board.on_law_response(&response);
                    self.open = None;
                }
            }
            self.board.plan(self.now(), &mut self.out);
            self.board.report(self.now(), &mut self.out);
            if let Some(request) = self.board.take_law_request() {
                self.requests.push((self.tick, request));
                self.open = self.takes.map(|ticks| (request, ticks));
            }
            self.tick += 1;
        }
    }

    /// Sends a position each 33 ms, of a ball that comes nearer. Returns the motor positions
    /// of each millisecond.
    fn run_with_ball(&mut self, pictures: u32) -> Vec<[i32; 3]> {
        let mut positions = Vec::new();
        for k in 0..pictures {
            let part = f64::from(k.min(40)) / 50.0;
            self.send_ball([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
            for _ in 0..33 {
                self.run(5);
                positions.push(self.board.positions());
            }
        }
        positions
    }

    fn still(&self) -> bool {
        self.board.rates() == [0; 3]
    }

    /// Returns the ball of a rig with a constant Jacobian: 0.3 mm a step, pattern (12).
    fn ball(&self) -> [f64; 3] {
        let [a, b, c] = self.board.positions().map(|p| f64::from(p) / 16.0 * 0.3e-3);
        let moved = [c - a - b, b - a, -a - b - c];
        [0, 1, 2].map(|i| BALL[i] + moved[i])
    }

    fn has_reported(&mut self, fault: Fault) -> bool {
        let mut accumulator = Accumulator::new();
        let mut messages =
            self.out.bytes().iter().filter_map(|&b| accumulator.push::<FromBoard>(b));
        messages
            .any(|message| matches!(message, Ok(FromBoard::Fault(report)) if report.fault == fault))
    }
}

#[test]
fn a_response_takes_effect_in_its_tick_however_early_it_comes() {
    for (law, kind) in [
        (Law::Adaptive as fn(_) -> _, DeferredLawKind::Adaptive),
        (Law::Taut, DeferredLawKind::Taut),
    ] {
        let [early, late] = [1, kind.ticks()]
            .map(|takes| DeferredBench::seeking(deferred(law), Some(takes)).run_with_ball(60));
        assert_eq!(early, late, "{kind:?}");
        assert!(early.last().unwrap().iter().any(|p| p.abs() > 1000), "{kind:?} moves");
        let mut bench = DeferredBench::seeking(deferred(law), Some(1));
        bench.send_ball(BALL);
        bench.run(kind.ticks());
        assert!(bench.still() && bench.requests.len() == 1, "{kind:?}: not before its tick");
        bench.run(1);
        assert!(!bench.still(), "{kind:?}: in its tick");
    }
}

#[test]
fn a_response_at_once_gives_the_same_motion() {
    let mut bench =
        DeferredBench::seeking(deferred(Law::Taut), Some(DeferredLawKind::Taut.ticks()));
    let chip = bench.run_with_ball(30);
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), None);
    let mut host = Vec::new();
    for k in 0..30 {
        let part = f64::from(k) / 50.0;
        bench.send_ball([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
        for tick in 1..=165 {
            bench.board.tick(bench.now(), &mut bench.law_worker, &mut bench.out);
            bench.tick += 1;
            host.extend((tick % 5 == 0).then(|| bench.board.positions()));
        }
    }
    assert_eq!(host, chip);
}

#[test]
fn a_missing_response_stops_the_board() {
    let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), Some(1));
    bench.run_with_ball(20);
    assert!(!bench.still());
    bench.takes = Some(DeferredLawKind::Adaptive.ticks() + 1);
    bench.out.clear();
    bench.send_ball(BALL);
    bench.run(DeferredLawKind::Adaptive.ticks() + 1);
    assert_eq!(bench.board.state(), State::Fault(Fault::LawLate));
    assert!(bench.has_reported(Fault::LawLate));
    bench.run(2000);
    assert!(bench.still());
}

#[test]
fn another_target_or_a_stop_voids_the_response() {
    for command in [Command::Target(point(BALL)), Command::Stop, Command::Hold] {
        for takes in [Some(3), None] {
            let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), takes);
            bench.send_ball(BALL);
            bench.run(2);
            bench.send(command);
            bench.run(1000);
            assert!(bench.still(), "{command:?}");
            assert_ne!(bench.board.state(), State::Fault(Fault::LawLate), "{command:?}");
        }
    }
}

#[test]
fn the_newest_position_waits_while_a_request_is_open() {
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), Some(5));
    for z in [0.40, 0.39, 0.38] {
        bench.send_ball([0.5, 0.3, z]);
        bench.run(10);
    }
    bench.run(DeferredLawKind::Taut.ticks());
    let seen: Vec<_> =
        bench.requests.iter().map(|(tick, q)| (*tick, q.number, q.measurement.ball[2])).collect();
    assert_eq!(seen, [(0, 1, 400_000), (u64::from(DeferredLawKind::Taut.ticks()), 2, 380_000)]);
}

#[test]
fn the_waiting_position_gets_the_present_target_and_a_stop_discards_it() {
    for (command, count) in [(Command::Target(point(BALL)), 2), (Command::Stop, 1)] {
        let mut bench = DeferredBench::seeking(deferred(Law::Taut), Some(5));
        bench.send_ball(BALL);
        bench.run(10);
        bench.send_ball(BALL);
        bench.send(command);
        bench.run(10);
        bench.send(Command::Target(point(BALL)));
        bench.run(DeferredLawKind::Taut.ticks());
        assert_eq!(bench.requests.len(), count, "{command:?}");
        let (_, request) = bench.requests.last().unwrap();
        let target = if count == 2 { BALL } else { TARGET };
        assert_eq!(request.measurement.target, point(target).micrometres());
    }
}

#[test]
fn a_configuration_makes_the_law_anew_and_a_target_does_not() {
    let mut bench = DeferredBench::seeking(deferred(Law::Taut), Some(5));
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
    let mut bench = DeferredBench::seeking(deferred(Law::Adaptive), Some(5));
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
        let mut bench = DeferredBench::seeking(config, Some(5));
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
        let mut bench = DeferredBench::seeking(deferred(law), Some(5));
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
