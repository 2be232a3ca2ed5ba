//! A Stop is in force, whoever sends what: campaign over seeds, in virtual time.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use plumb_cameras::camera_file;
use plumb_protocol::message::State;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::{
    BEGINS_ANEW_AFTER, OperatorCommand, OperatorSender, StopEvent, operator_with_clock,
};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::{Timing, VirtualBoard};
use plumb_tests::links::{FixedDetector, TrackingCamera, link};
use plumb_tests::parallel;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::scenario::{Blink, FIRST, RunTime, SECOND, circle};
use super::senders::{Kind, Sender};

/// Number of seeds.
const SEEDS: u64 = 1000;

/// Frames after a Stop in which the motors come to rest: a second for the ramp and the running mean
/// of the rates, and a second in which the link repeats the Stop.
const RAMP: u64 = 60;
/// Frames in which the motors stay at rest.
const REST: u64 = 45;
/// Most frames from the target of a new source until the ball moves: commands of the senders may
/// still wait for their answers.
const ANEW: u64 = 400;

/// Links of the campaign.
const LINKS: [&str; 6] =
    ["ideal", "115200 baud", "10 % lost", "latency 20 ms", "10 % doubled", "poor radio"];

/// When Stops and Resumes are sent; frames are counted from the run's begin.
#[derive(Debug)]
struct Plan {
    /// Whether a Stop is sent before the first picture.
    is_early: bool,
    /// Frames of the Stops.
    stops: Vec<u64>,
    /// Whether a Resume of the Stop before comes with the last Stop: before it or after it.
    race: Option<Race>,
    /// Whether the ball is hidden before the last Stop, so that it comes in a fault.
    is_in_fault: bool,
    /// Whether the last Stop is resumed once the motors rest.
    is_resumed: bool,
}

/// Order of a Resume and a Stop that cross.
#[derive(Debug, Clone, Copy)]
enum Race {
    ResumeFirst,
    StopFirst,
}

impl Plan {
    fn new(random: &mut ChaCha8Rng) -> Self {
        let first = random.random_range(0..90);
        let mut stops = vec![first];
        if random.random_bool(0.3) {
            stops.push(first + random.random_range(0..30));
        }
        let race = [None, Some(Race::ResumeFirst), Some(Race::StopFirst)];
        Self {
            is_early: random.random_bool(0.1),
            race: race.choose(random).copied().flatten().filter(|_| stops.len() > 1),
            is_in_fault: random.random_bool(0.2),
            is_resumed: random.random_bool(0.5),
            stops,
        }
    }

    fn last_stop(&self) -> u64 {
        self.stops[self.stops.len() - 1]
    }

    /// Frame from which on the motors must rest.
    fn rests(&self) -> u64 {
        self.last_stop() + RAMP
    }

    /// Frame of the Resume.
    fn resume(&self) -> u64 {
        self.rests() + REST
    }

    /// Frame after which the senders are silent.
    fn silence(&self) -> u64 {
        self.resume() + RAMP + REST
    }

    /// Frame in which a new source sends a target.
    fn anew(&self) -> u64 {
        self.silence() + 5
    }

    fn end(&self) -> u64 {
        if self.is_resumed { self.anew() + ANEW } else { self.resume() }
    }
}

/// Operator of a run in the campaign.
struct Campaign<'a> {
    plan: Plan,
    page: OperatorSender,
    senders: Vec<Sender>,
    board: &'a VirtualBoard,
    time: RunTime,
    /// Positions of the motors when they must rest, steps.
    rest: Option<[f64; 3]>,
    /// Number of the Stop before the last one.
    before: Option<u64>,
    failures: Vec<String>,
    /// Whether there was a picture.
    has_begun: bool,
    /// Whether the new source has moved the ball.
    has_moved: bool,
    resumed: u32,
    /// Outcomes of the Stops and Resumes.
    commands: Vec<String>,
}

impl Campaign<'_> {
    fn stop(&mut self) {
        self.before = self.page.stop().map(|stop| stop.number);
        self.page.send(OperatorCommand::Stop).expect("a run that goes on");
    }

    fn resume(&self, stop: Option<u64>) {
        if let Some(stop) = stop {
            // One that names another Stop is refused.
            let _other = self.page.send(OperatorCommand::Resume { stop });
        }
    }

    /// Sends the Stops and Resumes of the plan.
    fn follow_plan(&mut self, number: u64) {
        for at in self.plan.stops.clone() {
            if number != at {
                continue;
            }
            let known = self.page.stop().map(|stop| stop.number);
            match self.plan.race.filter(|_| at == self.plan.last_stop()) {
                Some(Race::ResumeFirst) => {
                    self.resume(known);
                    self.stop();
                }
                Some(Race::StopFirst) => {
                    self.stop();
                    self.resume(known);
                }
                None => self.stop(),
            }
        }
        if self.plan.is_resumed && number == self.plan.resume() {
            // A motion that begins before the Resume, and a wrong number.
            let targets = self.page.targets();
            targets.send(targets.begin(), Instant::now(), SECOND.into(), None);
            self.resume(self.before);
            self.resume(self.page.stop().map(|stop| stop.number));
        }
    }

    /// Checks that the motors rest where they came to rest.
    fn check_rest(&mut self, number: u64) {
        let board = self.board.board().borrow();
        let (rates, motors, state) = (board.rates(), board.motors(), board.state());
        let rest = *self.rest.get_or_insert(motors);
        let stands = matches!(state, State::Ready | State::Fault(_));
        if rates != [0.0; 3] || motors != rest || !stands {
            let text = format!("frame {number}: {state:?}, rates {rates:?}, from {rest:?}");
            self.failures.push(format!("{text} to {motors:?}"));
        }
    }
}

impl Observer for Campaign<'_> {
    fn frame(&mut self, record: &FrameRecord) {
        self.has_begun = true;
        let (plan, number) = (&self.plan, record.number);
        self.time.set(record.time);
        let last = if plan.is_resumed { plan.silence() } else { plan.end() };
        let is_checked = (plan.rests()..last).contains(&number);
        let (mut end, anew) = (plan.end(), plan.anew());
        if is_checked {
            self.check_rest(number);
        }
        if number < last {
            self.senders.iter_mut().for_each(|sender| sender.act(number));
        }
        self.follow_plan(number);
        if number > anew {
            let rates = self.board.board().borrow().rates();
            self.has_moved |= rates != [0.0; 3];
            end = if self.has_moved { number } else { end };
        } else if number == anew {
            let visitor = self.page.source("a new page");
            let _no_fault = visitor.send(OperatorCommand::ClearFault);
            let target = OperatorCommand::Target(SECOND.into());
            if let Err(refusal) = visitor.send(target) {
                self.failures.push(format!("a new source: {refusal}; {:?}", self.commands));
            }
        }
        if number == end {
            // Its outcome comes before the next frame.
            let _ended = self.page.send(OperatorCommand::End);
        }
    }

    fn event(&mut self, record: &EventRecord) {
        let event = &record.event;
        let is_begun = matches!(event, RunEvent::TargetSet { .. });
        if is_begun && self.plan.is_early && !self.has_begun {
            self.failures.push("the list began after an early Stop".to_owned());
        }
        self.resumed += u32::from(matches!(event, RunEvent::Stop(StopEvent::Resumed { .. })));
        if let RunEvent::Command { command, outcome, .. } = event
            && matches!(command, OperatorCommand::Stop | OperatorCommand::Resume { .. })
        {
            self.commands.push(format!("{command}: {outcome:?}"));
        }
    }
}

/// Returns the senders of a run. Those that ask nobody are there only where nothing is resumed:
/// afterwards they may move the ball.
fn senders(plan: &Plan, page: &OperatorSender, random: &mut ChaCha8Rng) -> Vec<Sender> {
    let count = random.random_range(1..=4);
    let kinds = Kind::ALL.sample(random, count).copied().collect::<Vec<_>>();
    let is_fit = |kind: &Kind| !plan.is_resumed || *kind != Kind::Unasked;
    let new = |kind| Sender::new(kind, page, ChaCha8Rng::seed_from_u64(random.random()));
    kinds.into_iter().filter(is_fit).map(new).collect()
}

/// Runs `seed`. Returns what went wrong.
fn run_seed(seed: u64) -> Vec<String> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let plan = Plan::new(&mut random);
    let name = *LINKS.choose(&mut random).expect("a link");
    let mut rig = Rig::paper().expect("the paper's rig file");
    let laws = [LawName::Taut, LawName::Adaptive, LawName::Sign];
    rig.law = LawSettings::from(*laws.choose(&mut random).expect("a law"));
    rig.set_targets(&[FIRST, SECOND, FIRST]).expect("targets");
    let board = VirtualBoard::paper().expect("the paper's rig").with_wire((link(name).wire)(seed));
    let camera = camera_file::paper().expect("the paper's camera");
    let mut source = TrackingCamera::new(board.rig(), camera.clone(), Timing::default());
    let time = RunTime::default();
    let (page, receiver) = operator_with_clock(time.clock());
    if plan.is_early {
        page.send(OperatorCommand::Stop).expect("a run that begins");
    }
    let is_path = random.random_bool(0.2);
    let senders = senders(&plan, &page, &mut random);
    let description = format!(
        "seed {seed}, {name}, {:?}, {plan:?}, {:?}",
        rig.law.name(),
        senders.iter().map(|sender| sender.kind).collect::<Vec<_>>()
    );
    let hidden = match plan.is_in_fault {
        true => plan.last_stop().saturating_sub(25)..plan.last_stop() + 10,
        false => 0..0,
    };
    let (last, is_resumed) = (plan.end(), plan.is_resumed);
    let mut campaign = Campaign {
        plan,
        page,
        senders,
        board: &board,
        time,
        rest: None,
        before: None,
        failures: Vec::new(),
        has_begun: false,
        has_moved: false,
        resumed: 0,
        commands: Vec::new(),
    };
    let mut run = Run::connect(&rig, board.transport()).expect("a configured board");
    if is_path {
        run.set_path(circle(&rig)).expect("a path");
    }
    let interrupted = AtomicBool::new(false);
    let result = run.drive(RunParts {
        source: &mut source,
        detector: &mut Blink::new(FixedDetector(camera), hidden),
        observers: &mut [&mut campaign],
        operator: Some(receiver),
        timeout: 60.0,
        interrupted: &interrupted,
    });
    let Campaign { mut failures, has_moved, resumed, .. } = campaign;
    match result {
        Ok(summary) if summary.at_rest && (is_resumed || summary.frames == last + 1) => {}
        other => failures.push(format!("{other:?}")),
    }
    if is_resumed && (resumed == 0 || !has_moved) {
        failures.push(format!("resumed {resumed} times; a new source moves: {has_moved}"));
    }
    failures.truncate(3);
    failures.into_iter().map(|failure| format!("{description}: {failure}")).collect()
}

#[test]
fn a_stop_holds_whoever_sends_what_until_a_resume_that_moves_nothing() {
    assert!(Duration::from_secs(1) <= BEGINS_ANEW_AFTER, "senders are less than that apart");
    let failures = parallel::map(0..SEEDS, parallel::processors(), run_seed).concat();
    assert!(
        failures.is_empty(),
        "{} failures:\n{}",
        failures.len(),
        failures[..failures.len().min(10)].join("\n")
    );
}
