//! Targets that move, in virtual time: lines of JSON from a sender through the real intake, control
//! loop and link. How well the ball follows at different rates, over good links and poor ones, when
//! lines are late, out of order or cease, and when the target jumps or leaves the workspace.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Point3, Vector3};
use plumb_cameras::camera_file;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;
use plumb_runtime::observer::{FrameRecord, Observer, RunEvent, TargetsEvent};
use plumb_runtime::operator::{OperatorCommand, OperatorSender, operator};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts, StopReason, Summary, TargetUse, TargetsSummary};
use plumb_runtime::targets::{
    Arrivals, LeftOut, LineIntake, MotionId, TargetSource, TimedTarget, target_channel,
};
use plumb_sim::simulated::{Timing, VirtualBoard};
use plumb_tests::links::{FixedDetector, LinkCase, TrackingCamera, link};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Centre of the motions, metres: the middle of the paper's workspace.
const CENTRE: Point3<f64> = Point3::new(0.45, 0.30, 0.325);
/// Zero of the sender's clock, seconds on the host's.
const SENDER_ZERO_S: f64 = -1000.0;

/// A target that moves: its place at a time, seconds.
type Motion = fn(f64) -> Point3<f64>;

/// Circle of 5 cm at 5 cm/s.
fn circle(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(time.cos(), time.sin(), 0.0) * 0.05
}

/// Line of a sender.
struct Sent {
    arrival: f64,
    text: String,
}

/// A sender of lines, with the times of their arrival.
struct Sender {
    lines: Vec<Sent>,
    intake: LineIntake,
    motion: MotionId,
    /// Line that comes next.
    next: usize,
    left_out: LeftOut,
}

impl Sender {
    /// Sends the places of `motion` at `rate` (Hz) from `begin` to `end` (seconds), each `delay`
    /// (seconds, of its number) late.
    fn new(motion: Motion, rate: f64, times: [f64; 2], delay: impl FnMut(u64) -> f64) -> Self {
        let [begin, end] = times;
        let numbers = (begin * rate) as u64..(end * rate) as u64;
        Self::of(numbers.map(|k| k as f64 / rate), motion, delay)
    }

    /// Sends the places of `motion` at `times`.
    fn of(
        times: impl Iterator<Item = f64>,
        motion: Motion,
        mut delay: impl FnMut(u64) -> f64,
    ) -> Self {
        let sent = (0..).zip(times).map(|(k, time)| {
            let [x, y, z] = motion(time).into();
            let t = time - SENDER_ZERO_S;
            let text = format!("{{\"t\": {t:.6}, \"target\": [{x}, {y}, {z}]}}\n");
            Sent { arrival: time + delay(k), text }
        });
        let mut lines: Vec<Sent> = sent.collect();
        lines.sort_by(|a, b| a.arrival.total_cmp(&b.arrival));
        let (intake, left_out) = (LineIntake::default(), LeftOut::default());
        // The motions of this source are those of a channel, where the first one is begun.
        Self { lines, intake, motion: target_channel().0.begin(), next: 0, left_out }
    }
}

impl TargetSource for Sender {
    fn take(&mut self, now: f64) -> Arrivals {
        let mut arrivals = Arrivals::default();
        while let Some(Sent { arrival, text }) =
            self.lines.get(self.next).filter(|line| line.arrival <= now)
        {
            match self.intake.take(text, *arrival) {
                Ok(Some((line, time))) => arrivals.targets.push(TimedTarget {
                    motion: self.motion,
                    time,
                    position: line.position(),
                    velocity: line.velocity(),
                }),
                Ok(None) => {}
                Err(omission) => {
                    omission.kind.count(&mut self.left_out);
                    arrivals.problems.push(omission.problem);
                }
            }
            self.next += 1;
        }
        arrivals.left_out = self.left_out;
        arrivals.has_ended = self.next == self.lines.len();
        arrivals
    }

    fn newest_motion(&self) -> MotionId {
        self.motion
    }
}

/// Run after targets that move.
struct TargetRun {
    link: LinkCase,
    law: LawName,
    /// Longest wait for a target, seconds.
    timeout: f64,
}

impl Default for TargetRun {
    fn default() -> Self {
        Self { link: link("ideal"), law: LawName::Adaptive, timeout: 20.0 }
    }
}

/// What a run delivered.
struct Outcome {
    summary: Summary,
    records: Vec<FrameRecord>,
    events: Vec<(f64, TargetsEvent)>,
}

impl TargetRun {
    fn rig(&self) -> Rig {
        Rig { law: LawSettings::from(self.law), ..Rig::paper().unwrap() }
    }

    /// Follows the targets of `sender` to their end.
    fn drive(&self, sender: Sender) -> Outcome {
        self.drive_with(Box::new(sender), TargetUse::Goal, |_, _| {})
    }

    /// Follows the targets of `source`. `act` is called with the number of each frame; with an
    /// operator where the targets steer.
    fn drive_with(
        &self,
        source: Box<dyn TargetSource>,
        usage: TargetUse,
        act: impl FnMut(u64, &OperatorSender),
    ) -> Outcome {
        let rig = self.rig();
        let task = Task::paper();
        let plant = Box::new(QuasiStatic::new(task.geometry, task.start).unwrap());
        let simulated = VirtualBoard::new(plant).with_wire((self.link.wire)(7));
        simulated.board().borrow_mut().run_to(Micros(10_000)).unwrap();
        let camera = camera_file::paper().unwrap();
        let mut frames = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
        let interrupted = AtomicBool::new(false);
        let (sender, receiver) = operator();
        let mut seen = Seen { records: Vec::new(), events: Vec::new(), sender, act };
        let mut run = Run::connect(&rig, simulated.transport()).unwrap();
        run.set_targets(source, usage);
        let summary = run.drive(RunParts {
            source: &mut frames,
            detector: &mut FixedDetector(camera),
            observers: &mut [&mut seen],
            operator: (usage == TargetUse::Steering).then_some(receiver),
            timeout: self.timeout,
            interrupted: &interrupted,
        });
        assert!(!interrupted.load(Ordering::Relaxed));
        let Seen { records, events, .. } = seen;
        Outcome { summary: summary.unwrap(), records, events }
    }
}

/// Observer of a run.
struct Seen<F> {
    records: Vec<FrameRecord>,
    events: Vec<(f64, TargetsEvent)>,
    sender: OperatorSender,
    act: F,
}

impl<F: FnMut(u64, &OperatorSender)> Observer for Seen<F> {
    fn frame(&mut self, record: &FrameRecord) {
        // The time on the host's clock, in place of that since the begin.
        let time = record.frame.as_ref().unwrap().time();
        self.records.push(FrameRecord { frame: None, time, ..record.clone() });
        (self.act)(record.number, &self.sender);
    }

    fn event(&mut self, event: &RunEvent) {
        if let RunEvent::Targets(event) = event {
            let time = self.records.last().map_or(0.0, |record| record.time);
            self.events.push((time, event.clone()));
        }
    }
}

impl Outcome {
    fn targets(&self) -> &TargetsSummary {
        self.summary.targets.as_ref().unwrap()
    }

    /// Checks that the run ended well: the board holds the ball at the last place.
    fn check_reached(&self, name: &str) {
        let Summary { reached, at_rest, .. } = &self.summary;
        assert!(*reached && *at_rest, "{name}: {:?}", self.summary);
    }

    /// Returns the largest distance of the true ball from `motion`, metres, in the frames from
    /// `from` to `to` seconds.
    fn farthest(&self, motion: Motion, from: f64, to: f64) -> f64 {
        let within = self.records.iter().filter(|record| (from..to).contains(&record.time));
        let distances = within.map(|it| (it.position().unwrap() - motion(it.time)).norm());
        distances.fold(0.0, f64::max)
    }

    /// Returns the largest speed (m/s) and acceleration (m/s²) of the board's reference over the
    /// time of three frames.
    fn largest_of_reference(&self) -> (f64, f64) {
        let states: Vec<(f64, Vector3<f64>)> = self
            .records
            .iter()
            .filter_map(|record| {
                let telemetry = record.telemetry?;
                let reference = telemetry.reference?;
                let place = Vector3::from(reference.position.to_metres());
                Some((telemetry.time.0 as f64 * 1e-6, place))
            })
            .collect();
        let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
        for window in states.windows(3) {
            let [(a, p), (b, q), (c, r)] = [window[0], window[1], window[2]];
            if !(0.02..0.1).contains(&(b - a)) || !(0.02..0.1).contains(&(c - b)) {
                continue;
            }
            let (before, after) = ((q - p) / (b - a), (r - q) / (c - b));
            speed = speed.max(after.norm());
            acceleration = acceleration.max((after - before).norm() / (0.5 * (c - a)));
        }
        (speed, acceleration)
    }

    /// Returns the largest distance of the ball from the board's reference, metres.
    fn farthest_from_reference(&self) -> f64 {
        let distances = self.records.iter().filter_map(|record| {
            let reference = record.telemetry?.reference?.position.to_metres();
            Some((record.position()? - Point3::from(reference)).norm())
        });
        distances.fold(0.0, f64::max)
    }

    fn has(&self, wanted: &TargetsEvent) -> bool {
        self.events.iter().any(|(_, event)| event == wanted)
    }
}

/// Delays of a busy network: up to 20 ms, every twentieth line 70 ms.
fn jitter(seed: u64) -> impl FnMut(u64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move |k| if k % 20 == 7 { 0.07 } else { random.random_range(0.0..0.02) }
}

#[test]
fn the_ball_follows_targets_that_come_late_and_out_of_order_over_every_link() {
    let names = ["ideal", "115200 baud", "2 ms", "10 % lost", "latency 20 ms", "poor radio"];
    for rate in [30.0, 200.0] {
        for name in names {
            let run = TargetRun { link: link(name), ..TargetRun::default() };
            let outcome = run.drive(Sender::new(circle, rate, [0.5, 10.0], jitter(1)));
            outcome.check_reached(name);
            let targets = outcome.targets();
            assert!(targets.spreads.error.rms_mm <= 2.0, "{name}, {rate} Hz: {targets:?}");
            assert!(targets.left_out.out_of_order > 5, "{name}, {rate} Hz: {targets:?}");
            let farthest = outcome.farthest(circle, 4.0, 9.9);
            assert!(farthest <= 0.006, "{name}, {rate} Hz: {farthest} m");
        }
    }
}

#[test]
fn the_default_law_follows_too() {
    let run = TargetRun { law: LawName::Taut, ..TargetRun::default() };
    let outcome = run.drive(Sender::new(circle, 30.0, [0.5, 10.0], jitter(2)));
    outcome.check_reached("taut");
    assert!(outcome.farthest(circle, 5.0, 9.9) <= 0.010, "{:?}", outcome.targets());
}

#[test]
fn targets_that_cease_let_the_ball_rest_and_it_goes_on_when_they_come_again() {
    let before = (0..).map(|k| 0.5 + f64::from(k) / 30.0).take_while(|time| *time < 5.0);
    let after = (0..).map(|k| 9.0 + f64::from(k) / 30.0).take_while(|time| *time < 14.0);
    let sender = Sender::of(before.chain(after), circle, |_| 0.01);
    let outcome = TargetRun::default().drive(sender);
    outcome.check_reached("ceased");
    let rested = |record: &&FrameRecord| (6.5..8.9).contains(&record.time);
    let places = outcome.records.iter().filter(rested).map(|it| it.position().unwrap());
    let places: Vec<Point3<f64>> = places.collect();
    // The target goes on for 0.4 s and comes to rest within another 0.4 s: 3 cm.
    let rest = circle(5.0 + 0.6);
    let farthest = places.iter().map(|place| (place - rest).norm()).fold(0.0, f64::max);
    assert!(places.len() > 60 && farthest < 0.006, "{farthest}");
    let holds = |record: &FrameRecord| record.telemetry.unwrap().state == State::Holding;
    assert!(outcome.records.iter().filter(rested).any(holds));
    assert!(outcome.has(&TargetsEvent::Ceased) && outcome.has(&TargetsEvent::Resumed));
    assert_eq!(outcome.targets().pauses, 1);
    assert!(outcome.farthest(circle, 12.0, 13.9) < 0.005);
    let (speed, acceleration) = outcome.largest_of_reference();
    assert!(speed <= 0.3 && acceleration <= 1.1, "{speed} m/s, {acceleration} m/s²");
}

/// A target that rests and jumps by 20 cm.
fn jump(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(0.0, if time < 4.0 { -0.1 } else { 0.1 }, 0.0)
}

#[test]
fn the_ball_follows_a_jump_within_the_limits_of_the_rig_file() {
    for (law, rate) in [
        (LawName::Adaptive, 30.0),
        (LawName::Adaptive, 200.0),
        (LawName::Taut, 30.0),
        (LawName::Taut, 200.0),
    ] {
        let run = TargetRun { law, ..TargetRun::default() };
        let outcome = run.drive(Sender::new(jump, rate, [0.5, 9.0], |_| 0.01));
        outcome.check_reached("jump");
        let (speed, acceleration) = outcome.largest_of_reference();
        assert!((0.1..=0.3).contains(&speed), "{law}, {rate} Hz: {speed} m/s");
        assert!(acceleration <= 1.1, "{law}, {rate} Hz: {acceleration} m/s²");
        let farthest = outcome.farthest(jump, 8.0, 8.9);
        assert!(farthest < 0.003, "{farthest}, {:?}", outcome.targets());
        let overshoot = outcome.records.iter().map(|it| it.position().unwrap().y);
        let overshoot = overshoot.fold(0.0, f64::max) - jump(9.0).y;
        assert!(overshoot < 0.02, "{law}, {rate} Hz: {overshoot}");
    }
}

/// A target that is dragged to and fro, at up to 60 cm/s.
fn shaken(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(0.15 * (4.0 * time).sin(), 0.0, 0.0)
}

#[test]
fn a_target_that_is_too_fast_for_the_ball_stops_no_board() {
    for law in [LawName::Adaptive, LawName::Taut] {
        let run = TargetRun { law, ..TargetRun::default() };
        let outcome = run.drive(Sender::new(shaken, 30.0, [0.2, 20.0], jitter(4)));
        outcome.check_reached("shaken");
        let apart = outcome.farthest_from_reference();
        assert!(apart < 0.07, "{law}: the reference is {apart} m from the ball");
    }
}

/// A target that a person drags out of the triangle of the motors in a second.
fn dragged_out(time: f64) -> Point3<f64> {
    let way = ((time - 0.8) / 1.0).clamp(0.0, 1.0);
    Point3::new(0.56 - 0.46 * way, 0.395 + 0.105 * way, 0.30)
}

#[test]
fn a_target_that_is_dragged_out_of_the_triangle_stops_no_board() {
    for law in [LawName::Adaptive, LawName::Taut] {
        let run = TargetRun { law, ..TargetRun::default() };
        let sender = Box::new(Sender::new(dragged_out, 30.0, [0.8, 12.0], |_| 0.01));
        let outcome = run.drive_with(sender, TargetUse::Steering, |number, sender| {
            if number == 300 {
                sender.send(OperatorCommand::End).unwrap();
            }
        });
        assert_eq!(outcome.summary.ending, StopReason::Ended, "{law}: {:?}", outcome.targets());
        let last = outcome.records.last().unwrap();
        // The last place in the triangle; the refused ones do not begin it anew.
        let last_good = Point3::new(0.4373, 0.4230, 0.30);
        assert!((last.position().unwrap() - last_good).norm() < 0.003, "{law}: {last:?}");
        let held = outcome.records.iter().filter(|record| record.time > 7.0);
        let mut states = held.map(|record| record.telemetry.unwrap().state);
        assert!(states.all(|state| state == State::Holding), "{law}");
    }
}

/// Lowest height of the paper's workspace, metres.
const FLOOR: f64 = 0.05;

/// A target that swings through the lower border of the workspace, at up to 15 cm/s.
fn swing(time: f64) -> Point3<f64> {
    Point3::new(CENTRE.x, CENTRE.y, FLOOR + 0.05 + 0.1 * (1.5 * time).cos())
}

#[test]
fn a_target_that_leaves_the_workspace_is_refused_and_followed_when_it_is_back() {
    for rate in [30.0, 200.0] {
        let outcome = TargetRun::default().drive(Sender::new(swing, rate, [0.5, 20.0], jitter(3)));
        outcome.check_reached("swing");
        let targets = outcome.targets();
        assert!(targets.refused > 100 && targets.taken > 300, "{targets:?}");
        let refusals = outcome
            .events
            .iter()
            .filter(|(_, event)| matches!(event, TargetsEvent::Refused { .. }));
        let count = refusals.count();
        assert!((3..10).contains(&count), "{count} messages, one a second at most");
        let lowest = outcome.records.iter().map(|it| it.position().unwrap().z);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        assert!((FLOOR..FLOOR + 0.02).contains(&lowest), "{lowest}");
        // At the highest place the ball is with its target again.
        let highest = 4.0 * std::f64::consts::PI / 1.5;
        let farthest = outcome.farthest(swing, highest - 0.2, highest + 0.2);
        assert!(farthest < 0.010, "{farthest}");
    }
}

#[test]
fn lines_that_are_held_up_are_left_out_and_the_ball_rests_meanwhile() {
    // From 4 s to 6 s nothing comes; then all of it at once.
    let held = |k: u64| {
        let time = 0.5 + k as f64 / 30.0;
        if (4.0..6.0).contains(&time) { 6.0 - time } else { 0.01 }
    };
    let times = (0..).map(|k| 0.5 + f64::from(k) / 30.0).take_while(|time| *time < 11.0);
    let outcome = TargetRun::default().drive(Sender::of(times, circle, held));
    outcome.check_reached("held up");
    let targets = outcome.targets();
    assert!((40..=50).contains(&targets.left_out.late), "{targets:?}");
    let rest = circle(4.0 + 0.6);
    let places = outcome.records.iter().filter(|it| (5.5..6.0).contains(&it.time));
    let far = places.map(|it| (it.position().unwrap() - rest).norm()).fold(0.0, f64::max);
    assert!(far < 0.006, "{far}");
    assert!(outcome.farthest(circle, 9.0, 10.9) < 0.005);
}

#[test]
fn a_stream_without_a_target_ends_the_run_with_the_reason() {
    let outcome = TargetRun::default().drive(Sender::new(circle, 30.0, [1.0, 1.0], |_| 0.0));
    assert_eq!(outcome.summary.ending, StopReason::NoTarget);
    assert!(!outcome.summary.reached && outcome.summary.legs.is_empty());
    let late = Sender::new(circle, 30.0, [30.0, 31.0], |_| 0.0);
    let outcome = TargetRun { timeout: 2.0, ..TargetRun::default() }.drive(late);
    assert_eq!(outcome.summary.ending, StopReason::Timeout);
    assert!(!outcome.summary.reached && outcome.records.last().unwrap().time < 3.0);
}

/// Two motions: targets of the second one come from its begin on.
struct Two {
    senders: [Sender; 2],
}

impl Two {
    fn new(mut senders: [Sender; 2]) -> Self {
        let (channel, _) = target_channel();
        for sender in &mut senders {
            sender.motion = channel.begin();
        }
        Self { senders }
    }
}

impl TargetSource for Two {
    fn take(&mut self, now: f64) -> Arrivals {
        let [first, second] = &mut self.senders;
        let (mut arrivals, more) = (first.take(now), second.take(now));
        arrivals.targets.extend(more.targets);
        Arrivals { has_ended: false, ..arrivals }
    }

    fn newest_motion(&self) -> MotionId {
        let [first, second] = &self.senders;
        if second.next > 0 { second.motion } else { first.motion }
    }
}

#[test]
fn a_stop_ends_a_motion_and_a_new_one_moves_the_ball_again() {
    let first = Sender::new(circle, 30.0, [0.5, 12.0], |_| 0.01);
    let second = Sender::new(circle, 30.0, [7.0, 12.0], |_| 0.01);
    let source = Box::new(Two::new([first, second]));
    let outcome = TargetRun::default().drive_with(source, TargetUse::Steering, |number, sender| {
        let command = match number {
            120 => OperatorCommand::Stop,
            355 => OperatorCommand::End,
            _ => return,
        };
        sender.send(command).unwrap();
    });
    let endings: Vec<_> = outcome.summary.legs.iter().map(|leg| leg.ending.clone()).collect();
    assert_eq!(endings, [StopReason::Replaced, StopReason::Stopped, StopReason::Ended]);
    let state = |time: f64| {
        let record = outcome.records.iter().find(|record| record.time >= time).unwrap();
        record.telemetry.unwrap().state
    };
    // The first motion goes on after the Stop at 4 s, and moves nothing.
    assert_eq!(
        [state(3.5), state(5.5), state(6.9), state(8.0)],
        [State::Following, State::Ready, State::Ready, State::Following,]
    );
    assert!(outcome.targets().ended > 100, "{:?}", outcome.targets());
    assert!(outcome.farthest(circle, 10.0, 11.5) < 0.005);
}
