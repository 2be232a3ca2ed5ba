//! DeferredLaw laws: questions and answers, and when those take effect.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod common;

use common::bench::{BALL, TARGET, point};
use common::{BUILD, config};
use plumb_core::law::DeferredLawKind;
use plumb_core::law::variances;
use plumb_core::law_worker::LawRequest;
use plumb_core::{Board, LawWorker, Outbox, TICK_US};
use plumb_protocol::Config;
use plumb_protocol::config::{Deadlines, Estimated, Law};
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Position, State, ToBoard};
use plumb_protocol::units::{Covariance, Micros, Milliseconds};

const DELAY: Estimated = Estimated { delay: Milliseconds(0) };

/// A board, and a thinker that takes some ticks for an answer.
struct SlowBench {
    board: Board,
    law_worker: LawWorker,
    /// Ticks from a question to its answer; `None` where there is none.
    takes: Option<u32>,
    open: Option<(LawRequest, u32)>,
    asked: Vec<(u64, LawRequest)>,
    tick: u64,
    out: Outbox,
    sequence: u16,
    id: u16,
}

fn slow(law: fn(Estimated) -> Law) -> Config {
    Config { law: law(DELAY), ..config() }
}

impl SlowBench {
    /// Seeks a target with a law, and has seen nothing yet.
    fn seeking(config: Config, takes: Option<u32>) -> Self {
        let mut bench = Self {
            board: Board::new(BUILD),
            law_worker: LawWorker::new(),
            takes,
            open: None,
            asked: Vec::new(),
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

    fn see(&mut self, ball: [f64; 3]) {
        self.see_within(ball, None);
    }

    fn see_within(&mut self, ball: [f64; 3], covariance: Option<Covariance>) {
        self.sequence += 1;
        let (sequence, ball) = (self.sequence, Some(point(ball)));
        self.send(Command::Position(Position { sequence, age_us: 30_000, ball, covariance }));
    }

    /// The chip's order: an answer that has come, the plan, and what there is to ask.
    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            if let Some((question, left)) = &mut self.open {
                *left -= 1;
                if *left == 0 {
                    let answer = self.law_worker.respond(question);
                    self.board.on_law_response(&answer);
                    self.open = None;
                }
            }
            self.board.plan(self.now(), &mut self.out);
            self.board.report(self.now(), &mut self.out);
            if let Some(question) = self.board.take_law_request() {
                self.asked.push((self.tick, question));
                self.open = self.takes.map(|ticks| (question, ticks));
            }
            self.tick += 1;
        }
    }

    /// A picture each 33 ms, of a ball that comes nearer.
    fn run_seeing(&mut self, pictures: u32) -> Vec<[i32; 3]> {
        let mut positions = Vec::new();
        for k in 0..pictures {
            let part = f64::from(k.min(40)) / 50.0;
            self.see([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
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

    /// The ball of a rig that is the same everywhere: 0.3 mm a step, pattern (12).
    fn ball(&self) -> [f64; 3] {
        let [a, b, c] = self.board.positions().map(|p| f64::from(p) / 16.0 * 0.3e-3);
        let moved = [c - a - b, b - a, -a - b - c];
        [0, 1, 2].map(|i| BALL[i] + moved[i])
    }

    fn told(&mut self, fault: Fault) -> bool {
        let mut accumulator = Accumulator::new();
        let mut heard = self.out.bytes().iter().filter_map(|&b| accumulator.push::<FromBoard>(b));
        heard
            .any(|message| matches!(message, Ok(FromBoard::Fault(report)) if report.fault == fault))
    }
}

#[test]
fn an_answer_takes_effect_in_its_tick_however_early_it_comes() {
    for (law, kind) in [
        (Law::Adaptive as fn(_) -> _, DeferredLawKind::Adaptive),
        (Law::Taut, DeferredLawKind::Taut),
    ] {
        let [early, late] = [1, kind.ticks()]
            .map(|takes| SlowBench::seeking(slow(law), Some(takes)).run_seeing(60));
        assert_eq!(early, late, "{kind:?}");
        assert!(early.last().unwrap().iter().any(|p| p.abs() > 1000), "{kind:?} moves");
        let mut bench = SlowBench::seeking(slow(law), Some(1));
        bench.see(BALL);
        bench.run(kind.ticks());
        assert!(bench.still() && bench.asked.len() == 1, "{kind:?}: not before its tick");
        bench.run(1);
        assert!(!bench.still(), "{kind:?}: in its tick");
    }
}

#[test]
fn a_host_that_thinks_at_once_does_the_same() {
    let mut bench = SlowBench::seeking(slow(Law::Taut), Some(DeferredLawKind::Taut.ticks()));
    let chip = bench.run_seeing(30);
    let mut bench = SlowBench::seeking(slow(Law::Taut), None);
    let mut host = Vec::new();
    for k in 0..30 {
        let part = f64::from(k) / 50.0;
        bench.see([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
        for tick in 1..=165 {
            bench.board.tick(bench.now(), &mut bench.law_worker, &mut bench.out);
            bench.tick += 1;
            host.extend((tick % 5 == 0).then(|| bench.board.positions()));
        }
    }
    assert_eq!(host, chip);
}

#[test]
fn an_answer_that_does_not_come_stops_the_board() {
    let mut bench = SlowBench::seeking(slow(Law::Adaptive), Some(1));
    bench.run_seeing(20);
    assert!(!bench.still());
    bench.takes = Some(DeferredLawKind::Adaptive.ticks() + 1);
    bench.out.clear();
    bench.see(BALL);
    bench.run(DeferredLawKind::Adaptive.ticks() + 1);
    assert_eq!(bench.board.state(), State::Fault(Fault::LawLate));
    assert!(bench.told(Fault::LawLate));
    bench.run(2000);
    assert!(bench.still());
}

#[test]
fn after_another_target_or_a_stop_the_answer_is_void() {
    for command in [Command::Target(point(BALL)), Command::Stop, Command::Hold] {
        for takes in [Some(3), None] {
            let mut bench = SlowBench::seeking(slow(Law::Adaptive), takes);
            bench.see(BALL);
            bench.run(2);
            bench.send(command);
            bench.run(1000);
            assert!(bench.still(), "{command:?}");
            assert_ne!(bench.board.state(), State::Fault(Fault::LawLate), "{command:?}");
        }
    }
}

#[test]
fn of_the_pictures_that_come_while_the_law_thinks_the_newest_waits() {
    let mut bench = SlowBench::seeking(slow(Law::Taut), Some(5));
    for z in [0.40, 0.39, 0.38] {
        bench.see([0.5, 0.3, z]);
        bench.run(10);
    }
    bench.run(DeferredLawKind::Taut.ticks());
    let seen: Vec<_> =
        bench.asked.iter().map(|(tick, q)| (*tick, q.number, q.measurement.ball[2])).collect();
    assert_eq!(seen, [(0, 1, 400_000), (u64::from(DeferredLawKind::Taut.ticks()), 2, 380_000)]);
}

#[test]
fn what_waits_is_asked_about_for_the_target_of_then_and_forgotten_by_a_stop() {
    for (command, questions) in [(Command::Target(point(BALL)), 2), (Command::Stop, 1)] {
        let mut bench = SlowBench::seeking(slow(Law::Taut), Some(5));
        bench.see(BALL);
        bench.run(10);
        bench.see(BALL);
        bench.send(command);
        bench.run(10);
        bench.send(Command::Target(point(BALL)));
        bench.run(DeferredLawKind::Taut.ticks());
        assert_eq!(bench.asked.len(), questions, "{command:?}");
        let (_, question) = bench.asked.last().unwrap();
        let target = if questions == 2 { BALL } else { TARGET };
        assert_eq!(question.measurement.target, point(target).micrometres());
    }
}

#[test]
fn a_law_begins_anew_with_each_configuration_and_not_with_a_target() {
    let mut bench = SlowBench::seeking(slow(Law::Taut), Some(5));
    let made_for =
        |bench: &SlowBench| bench.asked.iter().map(|(_, q)| q.generation).collect::<Vec<_>>();
    bench.run_seeing(2);
    bench.send(Command::Target(point(BALL)));
    bench.run_seeing(1);
    assert_eq!(made_for(&bench), [1, 1, 1]);
    bench.send(Command::Stop);
    bench.run(3000);
    bench.send(Command::Configure(slow(Law::Adaptive)));
    bench.send(Command::Target(point(TARGET)));
    bench.run_seeing(2);
    assert_eq!(made_for(&bench), [1, 1, 1, 2, 2]);
    assert_eq!(bench.asked[4].1.kind, DeferredLawKind::Adaptive);
}

#[test]
fn how_sure_a_position_is_comes_to_the_law() {
    let mut bench = SlowBench::seeking(slow(Law::Adaptive), Some(5));
    bench.see(BALL);
    bench.run(20);
    bench.see_within(BALL, Some(Covariance { variances: [900, 1, u16::MAX], covariances: [0; 3] }));
    bench.run(20);
    let told: Vec<[i32; 3]> =
        bench.asked.iter().map(|(_, question)| question.measurement.variances).collect();
    assert_eq!(told, [[4_000_000, 1_000_000, 1_000_000], [9_490_000, 500_000, 655_840_000]]);
}

/// A picture is the last for 400 ms, in which its rates would bring the ball to its target twice.
#[test]
fn the_motors_go_no_farther_than_the_steps_that_were_to_go() {
    let deadlines = Deadlines { host: Milliseconds(1_000), ..config().deadlines };
    for last_mm in [60.0, 30.0, 15.0] {
        let config = Config { deadlines, ..slow(Law::Adaptive) };
        let mut bench = SlowBench::seeking(config, Some(5));
        let away_mm = |bench: &SlowBench| {
            let ball = bench.ball();
            1e3 * (0..3).map(|i| (ball[i] - TARGET[i]).powi(2)).sum::<f64>().sqrt()
        };
        while away_mm(&bench) > last_mm {
            bench.see(bench.ball());
            bench.run(165);
        }
        let before = away_mm(&bench);
        bench.run(2000 - 165);
        assert!(bench.still(), "{last_mm} mm");
        assert!(away_mm(&bench) < 0.3 * before, "{before} mm, {} mm later", away_mm(&bench));
    }
}

#[test]
fn a_law_goes_less_by_a_position_that_is_unsure() {
    for law in [Law::Adaptive, Law::Taut] {
        let mut bench = SlowBench::seeking(slow(law), Some(5));
        for _ in 0..20 {
            bench.see(bench.ball());
            bench.run(165);
        }
        let (_, question) = bench.asked[bench.asked.len() - 1];
        let answer = |off_um: i32, variance: u16| {
            let mut measurement = question.measurement;
            measurement.ball[0] += off_um;
            measurement.variances =
                variances(Some(Covariance { variances: [variance; 3], covariances: [0; 3] }));
            bench
                .law_worker
                .clone()
                .respond(&LawRequest { measurement, ..question })
                .setpoint
                .rates
                .0
        };
        let moved = |variance| -> i32 {
            let (there, off) = (answer(0, variance), answer(4000, variance));
            (0..3).map(|k| (there[k] - off[k]).abs()).sum()
        };
        // Standard deviations of 1 mm and of 10 mm.
        assert!(2 * moved(10_000) < moved(100), "{} {}", moved(10_000), moved(100));
        assert!(moved(10_000) > 0);
    }
}
