//! Tests of the checkers: events of a correct board, with one error.

use plumb_core::board::FlashTask;
use plumb_core::{Pulses, StepPlan, Tick};
use plumb_protocol::message::{self, *};
use plumb_protocol::units::{Micrometres, Micros, Milliseconds, Point, Rate, Steps16};
use plumb_protocol::{Config, MOTORS};

use super::super::event::{Cut, Delivery, Snapshot, TICK, Ticked};
use super::*;
use crate::generate;
use crate::random::Random;

/// A host, a configuration and the checkers of a correct board.
struct Bench {
    invariants: Invariants,
    config: Config,
    now: u64,
    id: u16,
    at: Snapshot,
    outcome: Outcome,
}

/// Motor rates of 50 steps/s: a pulse every 6.25 ticks.
const RATE: i32 = 50 << 8;

impl Bench {
    /// Returns a configured board with three motors after Hello.
    fn ready() -> Self {
        Self::with_motors(MOTORS)
    }

    /// Returns a configured board with `count` motors after Hello.
    fn with_motors(count: usize) -> Self {
        let mut configs = (1..).map(|seed| generate::typical(&mut Random::new(seed)));
        let config = configs.find(|config| config.motors.len() == count).unwrap();
        let config = Config { mean: Milliseconds(0), ..config };
        let at = Snapshot {
            positions: [0; 3],
            travel: [0; 3],
            rates: [0; 3],
            state: State::Unconfigured,
            generation: 0,
        };
        let board = Board::new(generate::build(true));
        let (invariants, outcome) = (Invariants::new(&board), Outcome::of(0));
        let mut bench = Self { invariants, config, now: 0, id: 0, at, outcome };
        let after = Snapshot { state: State::Ready, generation: 1, ..at };
        let hello = BoardHello { id: 1, hello: Hello::OURS, max_pulse_rate: 0, accepted: true };
        let started = FromBoard::Started(StartCause::PowerOn);
        bench.deliver(Command::Hello(Hello::OURS), &[FromBoard::Hello(hello), started], at);
        bench.deliver(Command::Configure(config), &[answer(2, None)], after);
        bench
    }

    /// Returns a board that seeks a target.
    fn seeking() -> Self {
        let mut bench = Self::ready();
        let after = Snapshot { state: State::Seeking, ..bench.at };
        bench.deliver(Command::Target(Point::default()), &[answer(3, None)], after);
        bench
    }

    /// Delivers the next command, with the correct answer.
    fn deliver(&mut self, command: Command, replies: &[FromBoard], after: Snapshot) {
        self.id += 1;
        let message = Ok(ToBoard { id: self.id, command });
        let (at, before) = (self.now, self.at);
        let delivery = Delivery { at, message, repeated: false, replies, before, after };
        self.invariants.delivered(&delivery, Some(&self.config), &mut self.outcome);
        self.at = after;
    }

    /// Executes a tick with these pulses, which ends in `after`.
    fn tick(
        &mut self,
        after: Snapshot,
        plan: StepPlan,
        requests: Option<Tick>,
        replies: &[FromBoard],
    ) {
        let (now, before) = (self.now, self.at);
        let ticked = Ticked { now, before, after, plan, requests, replies, emergency: false };
        self.invariants.ticked(&ticked, &mut self.outcome);
        self.at = after;
        self.now += TICK;
    }

    /// Executes ticks with telemetry only.
    fn rest(&mut self, ticks: u64) {
        for _ in 0..ticks {
            let telemetry = telemetry(self.now);
            self.tick(self.at, StepPlan::default(), None, &[telemetry]);
        }
    }

    /// Asserts that this invariant was broken, and no other.
    fn assert_only(&self, invariant: &str) {
        let broken: Vec<_> = self.outcome.violations.iter().map(|v| v.invariant).collect();
        assert_eq!(broken, [invariant], "{:?}", self.outcome.violations);
    }
}

fn answer(id: u16, refusal: Option<Refusal>) -> FromBoard {
    FromBoard::Answer(Answer { id, refusal, time: Micros(0) })
}

fn report(fault: Fault) -> FromBoard {
    FromBoard::Fault(FaultReport { time: Micros(0), fault, configuration: Some(2) })
}

fn telemetry(now: u64) -> FromBoard {
    FromBoard::Telemetry(at_rest(now))
}

/// Returns the telemetry of a configured board at rest.
fn at_rest(now: u64) -> message::Telemetry {
    message::Telemetry {
        time: Micros(now),
        state: State::Ready,
        configuration: Some(2),
        target: None,
        sequence: None,
        motors: [Steps16(0); 3].into(),
        rates: [Rate(0); 3].into(),
        error: Point::default(),
        filtered_error: Micrometres(0),
        bad_frames: 0,
        tensions: None,
        reference: None,
        late_ticks: 0,
    }
}

/// Returns a plan with `count` pulses of motor A.
fn pulses(count: u16, first: u32, period: u32) -> StepPlan {
    let mut plan = StepPlan::default();
    plan.motors[0] = Pulses { direction: true, count, first, period };
    plan
}

/// Returns the board after motor A has moved by `steps` 1/16 steps at `rate`.
fn turned(at: Snapshot, steps: i32, rate: i32) -> Snapshot {
    let by = |[a, b, c]: [i32; 3]| [a + steps, b, c];
    Snapshot { positions: by(at.positions), travel: by(at.travel), rates: [rate, 0, 0], ..at }
}

#[test]
fn a_correct_board_breaks_no_invariant() {
    let mut bench = Bench::seeking();
    bench.rest(100);
    bench.tick(turned(bench.at, 1, 102), pulses(1, 7, 25_000), None, &[]);
    assert_eq!(bench.outcome.violations, []);
}

#[test]
fn motion_without_a_configuration_is_found() {
    let mut bench = Bench::ready();
    bench.invariants.limits = None;
    bench.invariants.standstill = Bench::seeking().invariants.standstill;
    bench.tick(turned(bench.at, 1, 0), pulses(1, 7, 25_000), None, &[]);
    bench.assert_only(motion::CONFIGURED);
}

#[test]
fn a_position_without_a_pulse_is_found() {
    let mut bench = Bench::seeking();
    bench.tick(turned(bench.at, 2, 102), pulses(1, 7, 25_000), None, &[]);
    bench.assert_only(motion::POSITIONS);
}

#[test]
fn a_pulse_after_its_tick_is_found() {
    let mut bench = Bench::seeking();
    bench.tick(turned(bench.at, 2, 102), pulses(2, 100, 24_900), None, &[]);
    bench.assert_only(motion::PULSES);
}

#[test]
fn a_rate_above_the_limit_is_found() {
    let mut bench = Bench::seeking();
    let most = bench.config.motors[0].max_rate.0;
    // 2000 steps/s² are 102.4 Q8 steps/s per tick.
    for tick in 1..=1002 {
        let rate = (tick * 1024 / 10).min(most + 1);
        bench.tick(turned(bench.at, 0, rate), StepPlan::default(), None, &[telemetry(bench.now)]);
    }
    bench.assert_only(motion::RATE);
}

#[test]
fn a_pulse_of_a_motor_that_the_rig_has_not_is_found() {
    let mut bench = Bench::with_motors(2);
    let after = Snapshot { state: State::Seeking, ..bench.at };
    bench.deliver(Command::Target(Point::default()), &[answer(3, None)], after);
    let mut plan = pulses(1, 7, 25_000);
    plan.motors.swap(0, 2);
    let by = |[a, b, c]: [i32; 3]| [a, b, c + 1];
    let after = Snapshot { positions: by(after.positions), travel: by(after.travel), ..after };
    bench.tick(after, plan, None, &[]);
    bench.assert_only(motion::RATE);
}

#[test]
fn an_acceleration_above_the_limit_is_found() {
    let mut bench = Bench::seeking();
    bench.tick(turned(bench.at, 0, 104), StepPlan::default(), None, &[]);
    bench.assert_only(motion::ACCELERATION);
    let mut bench = Bench::seeking();
    for tick in 1..=64 {
        // Each is within a unit of rounding, but not their sum.
        bench.tick(turned(bench.at, 0, tick * 103), StepPlan::default(), None, &[]);
    }
    bench.assert_only(motion::ACCELERATION);
}

#[test]
fn a_pulse_beyond_the_travel_is_found() {
    let mut bench = Bench::seeking();
    bench.at.travel[0] = bench.config.motors[0].travel_max.0;
    bench.tick(turned(bench.at, 1, 0), pulses(1, 7, 25_000), None, &[]);
    bench.assert_only(motion::TRAVEL);
}

#[test]
fn a_motor_that_moves_further_outside_is_found() {
    let mut bench = Bench::seeking();
    bench.at.travel[0] = bench.config.motors[0].travel_max.0 + 50;
    bench.tick(turned(bench.at, 1, 0), pulses(1, 7, 25_000), None, &[]);
    bench.assert_only(motion::WAY_BACK);
}

#[test]
fn motion_without_a_command_is_found() {
    let mut bench = Bench::ready();
    bench.tick(turned(bench.at, 1, 0), pulses(1, 7, 25_000), None, &[]);
    bench.assert_only(standstill::STANDSTILL);
}

#[test]
fn a_stop_that_takes_too_long_is_found() {
    let mut bench = Bench::seeking();
    bench.at.rates[0] = RATE;
    bench.invariants.acceleration = Acceleration::default();
    let after = Snapshot { state: State::Ready, ..bench.at };
    bench.deliver(Command::Stop, &[answer(4, None)], after);
    let limits = Limits::of(&bench.config);
    // A stop from 50 steps/s at 2000 steps/s² takes 25 ms.
    assert!((125..135).contains(&limits.stop_ticks([RATE, 0, 0])));
    let slow = turned(bench.at, 0, 50);
    for _ in 0..limits.stop_ticks([RATE, 0, 0]) + 1 {
        bench.tick(slow, StepPlan::default(), None, &[telemetry(bench.now)]);
    }
    bench.assert_only(standstill::STANDSTILL);
}

#[test]
fn a_fault_that_clears_itself_is_found() {
    let mut bench = Bench::seeking();
    let fault = Fault::PositionLost;
    let after = Snapshot { state: State::Fault(fault), ..bench.at };
    bench.tick(after, StepPlan::default(), None, &[report(fault)]);
    bench.tick(Snapshot { state: State::Ready, ..after }, StepPlan::default(), None, &[]);
    bench.assert_only(faults::LATCHED);
}

#[test]
fn a_fault_without_a_report_is_found() {
    let mut bench = Bench::seeking();
    let after = Snapshot { state: State::Fault(Fault::BallOutside), ..bench.at };
    bench.tick(after, StepPlan::default(), None, &[]);
    bench.assert_only(faults::REPORTED);
}

#[test]
fn a_cleared_emergency_with_an_open_input_is_found() {
    let mut bench = Bench::seeking();
    let fault = Fault::EmergencyStop;
    let (before, ready) = (bench.at, Snapshot { state: State::Ready, ..bench.at });
    let after = Snapshot { state: State::Fault(fault), ..before };
    let cut = Cut { missing: [0; 3], before, after, replies: &[report(fault)] };
    bench.invariants.cut(&cut, &mut bench.outcome);
    bench.at = after;
    bench.deliver(Command::ClearFault, &[answer(4, None)], ready);
    bench.assert_only(faults::EMERGENCY);
}

#[test]
fn missed_deadlines_are_found() {
    let mut bench = Bench::seeking();
    // A silent host for 300 ms.
    bench.rest(1500 + 2 + 2);
    bench.assert_only(deadlines::HOST);
    let mut bench = Bench::seeking();
    // A host without a position for 500 ms, with a new target.
    for id in 0..25 {
        bench.rest(100 + 1);
        bench.deliver(Command::Target(Point::default()), &[answer(4 + id, None)], bench.at);
    }
    bench.assert_only(deadlines::POSITION);
}

#[test]
fn missing_and_wrong_answers_are_found() {
    for replies in [&[][..], &[answer(5, None)], &[answer(4, None), answer(4, None)]] {
        let mut bench = Bench::seeking();
        bench.deliver(Command::Status, replies, bench.at);
        bench.assert_only(answers::ANSWERED);
    }
}

#[test]
fn a_missing_diagnosis_is_found() {
    let mut bench = Bench::ready();
    bench.deliver(Command::Diagnose, &[], bench.at);
    bench.tick(bench.at, StepPlan::default(), Some(Tick::default()), &[]);
    bench.assert_only(answers::ANSWERED);
    let mut bench = Bench::ready();
    bench.deliver(Command::Diagnose, &[], bench.at);
    let asked = Tick { diagnose: true, ..Tick::default() };
    bench.tick(bench.at, StepPlan::default(), Some(asked), &[]);
    bench.invariants.diagnosed(&[], &mut bench.outcome);
    bench.assert_only(answers::ANSWERED);
}

#[test]
fn a_request_that_is_executed_twice_is_found() {
    let mut bench = Bench::ready();
    let after = Snapshot { generation: 2, ..bench.at };
    let message = Ok(ToBoard { id: 2, command: Command::Configure(bench.config) });
    let (at, before, replies) = (bench.now, bench.at, &[answer(2, None)][..]);
    let delivery = Delivery { at, message, repeated: true, replies, before, after };
    bench.invariants.delivered(&delivery, Some(&bench.config), &mut bench.outcome);
    bench.assert_only(answers::REPEATED);
}

#[test]
fn telemetry_of_another_configuration_is_found() {
    let mut bench = Bench::ready();
    bench.deliver(Command::Configure(bench.config), &[answer(3, None)], bench.at);
    bench.tick(bench.at, StepPlan::default(), None, &[telemetry(bench.now)]);
    bench.assert_only(answers::NAMED);
}

#[test]
fn telemetry_with_another_number_of_motors_is_found() {
    for (count, told) in [(3, 2), (2, 3)] {
        let mut bench = Bench::with_motors(count);
        let all = at_rest(bench.now);
        let motors = all.motors.up_to(told);
        let telemetry =
            message::Telemetry { motors, rates: all.rates.up_to(count), ..at_rest(bench.now) };
        bench.tick(bench.at, StepPlan::default(), None, &[FromBoard::Telemetry(telemetry)]);
        bench.assert_only(answers::ENTRIES);
    }
}

/// Tells where a reference is after 100 ms, at this multiple of the distance of its highest speed.
fn reference_after_100_ms(share: f64) -> Bench {
    let mut bench = Bench::ready();
    let following = Snapshot { state: State::Following, ..bench.at };
    let command = generate::reference(&mut Random::new(1), Some(bench.config));
    bench.deliver(Command::Follow(command), &[answer(3, None)], following);
    let highest = reference::highest_speed(&bench.config.path);
    let mut tell = |now: u64, x: f64| {
        let position = Point([x as i32, 0, 0].map(Micrometres));
        let reference = Some(ReferenceState { sequence: 1, time: Micros(0), pace: 256, position });
        let (state, target) = (State::Following, Some(3));
        let told = message::Telemetry { state, target, reference, ..at_rest(now) };
        bench.tick(following, StepPlan::default(), None, &[FromBoard::Telemetry(told)]);
    };
    tell(1_000_000, 0.0);
    tell(1_100_000, share * highest * 0.1);
    bench
}

#[test]
fn a_reference_that_jumps_is_found() {
    assert_eq!(reference_after_100_ms(0.99).outcome.violations, []);
    let bench = reference_after_100_ms(1.1);
    bench.assert_only(reference::REFERENCE);
}

#[test]
fn silence_of_the_board_is_found() {
    let mut bench = Bench::ready();
    for _ in 0..503 {
        bench.tick(bench.at, StepPlan::default(), None, &[]);
    }
    bench.assert_only(answers::TELEMETRY);
}

#[test]
fn a_store_without_an_answer_is_found() {
    let mut bench = Bench::ready();
    let store = Tick { drivers_enabled: true, flash: Some(FlashTask::Store), ..Tick::default() };
    bench.deliver(Command::Store, &[], bench.at);
    bench.tick(bench.at, StepPlan::default(), Some(store), &[]);
    bench.deliver(Command::Store, &[], bench.at);
    bench.invariants.stored(&[answer(4, None)], &mut bench.outcome);
    bench.assert_only(storage::STORED);
}

#[test]
fn a_target_after_bootloader_is_found() {
    let mut bench = Bench::ready();
    bench.deliver(Command::Bootloader, &[answer(3, None)], bench.at);
    let seeking = Snapshot { state: State::Seeking, ..bench.at };
    bench.deliver(Command::Target(Point::default()), &[answer(4, None)], seeking);
    bench.assert_only(bootloader::LAST);
}
