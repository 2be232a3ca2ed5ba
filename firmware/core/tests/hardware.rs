//! What the chip tells the board: the emergency input, why it started, what was kept in flash.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod common;

use common::{BUILD, config};
use plumb_core::{Board, BuildLimits, Outbox, TICK_US, Thinker, Tick};
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Fault, Jog, Refusal, StartCause, State};
use plumb_protocol::units::{Micros, Rate, Steps16};
use plumb_protocol::{Command, Config, FromBoard, Hello, ToBoard};

struct Bench {
    board: Board,
    thinker: Thinker,
    now: Micros,
    out: Outbox,
    /// What goes with the pulses, as it was last told.
    told: Tick,
}

impl Bench {
    fn new(build: BuildLimits) -> Self {
        let (board, thinker, out) = (Board::new(build), Thinker::new(), Outbox::new());
        Self { board, thinker, now: Micros(0), out, told: Tick::default() }
    }

    /// A board that was greeted and has this configuration.
    fn configured(config: Config) -> Self {
        let mut bench = Self::new(BUILD);
        bench.send(Command::Hello(Hello::OURS));
        bench.send(Command::Configure(config));
        bench.heard();
        bench
    }

    fn send(&mut self, command: Command) {
        let frame = encode(&ToBoard { id: 7, command }).unwrap();
        self.board.receive(self.now, &frame, &mut self.out);
    }

    fn heard(&mut self) -> Vec<FromBoard> {
        let mut accumulator = Accumulator::new();
        let heard =
            self.out.bytes().iter().filter_map(|&b| accumulator.push(b)).map(Result::unwrap).collect();
        self.out.clear();
        heard
    }

    fn refusals(&mut self) -> Vec<Option<Refusal>> {
        let answer = |m| if let FromBoard::Answer(a) = m { Some(a.refusal) } else { None };
        self.heard().into_iter().filter_map(answer).collect()
    }

    fn tick(&mut self) -> Tick {
        self.told = self.board.tick(self.now, &mut self.thinker, &mut self.out).unwrap_or(self.told);
        self.now.0 += u64::from(TICK_US);
        self.told
    }

    fn jog(&mut self) {
        let rate = Rate::from_si(400.0).unwrap();
        self.send(Command::Jog(Jog { motor: 0, distance: Steps16(16_000), rate }));
    }
}

#[test]
fn an_emergency_stops_dead_where_the_pulses_were_cut_off() {
    for reversed in [false, true] {
        let mut motors = config().motors;
        motors[0].reversed = reversed;
        let mut bench = Bench::configured(Config { motors, microsteps: 8, ..config() });
        bench.jog();
        (0..1000).for_each(|_| _ = bench.tick());
        let [planned, ..] = bench.board.positions();
        assert!(planned > 100);
        bench.heard();
        // The direction line is high where the motor pays out, unless it is reversed.
        let missing = if reversed { -3 } else { 3 };
        bench.board.emergency(bench.now, [missing, 0, 0], &mut bench.out);
        let tick = bench.tick();
        assert!(bench.board.pulses().motors.iter().all(|pulses| pulses.count == 0));
        assert!(!tick.drivers_enabled);
        assert_eq!(bench.board.positions(), [planned - 3 * 2, 0, 0]);
        assert_eq!(bench.board.state(), State::Fault(Fault::EmergencyStop));
        let told = |m: &FromBoard| matches!(m, FromBoard::Fault(f) if f.fault == Fault::EmergencyStop);
        assert_eq!(bench.heard().iter().filter(|m| told(m)).count(), 1);
    }
}

#[test]
fn an_emergency_is_cleared_only_once_the_input_is_closed() {
    let mut bench = Bench::configured(config());
    for _ in 0..3 {
        bench.board.emergency(bench.now, [0; 3], &mut bench.out);
        bench.send(Command::ClearFault);
        assert!(!bench.tick().drivers_enabled);
        assert_eq!(bench.board.state(), State::Fault(Fault::EmergencyStop));
    }
    bench.send(Command::ClearFault);
    assert!(bench.tick().drivers_enabled);
    assert_eq!(bench.board.state(), State::Ready);
    bench.jog();
    (0..100).for_each(|_| _ = bench.tick());
    assert!(bench.board.positions()[0] > 0);
}

#[test]
fn an_emergency_goes_before_another_fault() {
    let mut bench = Bench::configured(config());
    bench.jog();
    // The host is silent for too long.
    (0..2000).for_each(|_| _ = bench.tick());
    assert_eq!(bench.board.state(), State::Fault(Fault::HostSilent));
    bench.board.emergency(bench.now, [0; 3], &mut bench.out);
    assert_eq!(bench.board.state(), State::Fault(Fault::EmergencyStop));
}

#[test]
fn a_board_says_why_it_started_and_stays_stopped_where_it_was_its_own_doing() {
    use StartCause::*;
    for (cause, stopped) in [
        (PowerOn, false),
        (ResetPin, false),
        (Requested, false),
        (Watchdog, true),
        (Panic, true),
        (HardFault, true),
    ] {
        let mut bench = Bench::new(BUILD);
        bench.board.started(cause);
        bench.board.restore(&config());
        assert_eq!(bench.tick().drivers_enabled, !stopped, "{cause:?}");
        bench.send(Command::Hello(Hello::OURS));
        assert!(bench.heard().contains(&FromBoard::Started(cause)));
        bench.jog();
        let refusal = stopped.then_some(Refusal::Faulted(Fault::Watchdog));
        assert_eq!(bench.refusals(), [refusal], "{cause:?}");
        bench.send(Command::Stop);
        bench.send(Command::ClearFault);
        assert_eq!(bench.board.state(), State::Ready);
    }
}

#[test]
fn a_host_of_another_version_is_not_told_more_than_the_hello() {
    let mut bench = Bench::new(BUILD);
    bench.send(Command::Hello(Hello { version: 0, ..Hello::OURS }));
    assert!(matches!(bench.heard()[..], [FromBoard::Hello(hello)] if !hello.accepted));
}

#[test]
fn a_kept_configuration_is_taken_up_but_moves_nothing_before_a_hello() {
    let mut bench = Bench::new(BUILD);
    bench.board.restore(&config());
    assert_eq!(bench.board.state(), State::Ready);
    assert_eq!(bench.board.config(), Some(&config()));
    bench.jog();
    assert_eq!(bench.refusals(), [Some(Refusal::NotGreeted)]);
    bench.send(Command::Hello(Hello::OURS));
    bench.jog();
    (0..100).for_each(|_| _ = bench.tick());
    assert!(bench.board.positions()[0] > 0);
}

#[test]
fn a_kept_configuration_of_another_board_is_ignored() {
    let mut bench = Bench::new(BuildLimits { max_pulse_rate: 100, ..BUILD });
    bench.board.restore(&config());
    assert_eq!(bench.board.state(), State::Unconfigured);
}

#[test]
fn storing_is_answered_when_it_is_done_and_nothing_moves_meanwhile() {
    let mut bench = Bench::configured(config());
    for (written, answer) in [(true, None), (false, Some(Refusal::NotStored))] {
        bench.send(Command::Store);
        assert!(bench.tick().store);
        bench.jog();
        assert_eq!(bench.refusals(), [Some(Refusal::Busy(State::Ready))]);
        bench.board.stored(written, &mut bench.out);
        assert_eq!(bench.refusals(), [answer]);
        assert!(!bench.tick().store);
    }
    bench.jog();
    bench.tick();
    bench.send(Command::Store);
    assert_eq!(bench.refusals(), [None, Some(Refusal::Busy(State::Ready))]);
}

#[test]
fn what_cannot_be_stored_is_refused() {
    let mut bench = Bench::new(BuildLimits { storage: false, ..BUILD });
    bench.send(Command::Hello(Hello::OURS));
    bench.send(Command::Store);
    let mut unconfigured = Bench::new(BUILD);
    unconfigured.send(Command::Hello(Hello::OURS));
    unconfigured.send(Command::Store);
    assert_eq!(bench.refusals(), [Some(Refusal::Unsupported)]);
    assert_eq!(unconfigured.refusals(), [Some(Refusal::Unconfigured)]);
}
