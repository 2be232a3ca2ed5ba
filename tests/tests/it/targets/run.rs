//! A run after targets that move, and what it delivered.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Point3, Vector3};
use plumb_cameras::camera_file;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent, TargetsEvent};
use plumb_runtime::operator::{OperatorSender, operator};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts, Summary, TargetUse, TargetsSummary};
use plumb_runtime::targets::TargetSource;
use plumb_sim::simulated::Timing;
use plumb_tests::links::{FixedDetector, LinkCase, TrackingCamera, link};
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::BallObservation;

use super::sender::{Motion, Sender};

/// Run after targets that move.
pub(crate) struct TargetRun {
    pub(crate) link: LinkCase,
    pub(crate) law: LawName,
    /// Longest wait for a target, seconds.
    pub(crate) timeout: f64,
    /// Whether the pictures show the ball.
    pub(crate) is_seen: bool,
    /// `motors.max_rate`, full steps/s; `None` for that of the paper's rig.
    pub(crate) max_rate: Option<f64>,
}

impl Default for TargetRun {
    fn default() -> Self {
        let (link, law) = (link("ideal"), LawName::Adaptive);
        Self { link, law, timeout: 20.0, is_seen: true, max_rate: None }
    }
}

/// Detector that finds the ball where it `is_seen`.
struct Sight {
    detector: FixedDetector,
    is_seen: bool,
}

impl BallDetector for Sight {
    fn name(&self) -> &'static str {
        self.detector.name()
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        Ok(self.detector.detect(frame)?.filter(|_| self.is_seen))
    }
}

/// What a run delivered.
pub(crate) struct Outcome {
    pub(crate) summary: Summary,
    pub(crate) records: Vec<FrameRecord>,
    pub(crate) events: Vec<(f64, TargetsEvent)>,
}

impl TargetRun {
    fn rig(&self) -> Rig {
        let mut rig = Rig { law: LawSettings::from(self.law), ..Rig::paper().unwrap() };
        if let Some(rate) = self.max_rate {
            rig.motors.max_rate = rate.try_into().unwrap();
        }
        rig
    }

    /// Follows the targets of `sender` to their end.
    pub(crate) fn drive(&self, sender: Sender) -> Outcome {
        self.drive_with(Box::new(sender), TargetUse::Goal, |_, _| {})
    }

    /// Follows the targets of `source`. `act` is called with the number of each frame; with an
    /// operator where the targets steer.
    pub(crate) fn drive_with(
        &self,
        source: Box<dyn TargetSource>,
        usage: TargetUse,
        act: impl FnMut(u64, &OperatorSender),
    ) -> Outcome {
        let rig = self.rig();
        let simulated = self.link.paper_board(7);
        let camera = camera_file::paper().unwrap();
        let mut frames = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
        let interrupted = AtomicBool::new(false);
        let (sender, receiver) = operator();
        let mut seen = Seen { records: Vec::new(), events: Vec::new(), sender, act };
        let mut run = Run::connect(&rig, simulated.transport()).unwrap();
        run.set_targets(source, usage);
        let summary = run.drive(RunParts {
            source: &mut frames,
            detector: &mut Sight { detector: FixedDetector(camera), is_seen: self.is_seen },
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
pub(crate) struct Seen<F> {
    records: Vec<FrameRecord>,
    events: Vec<(f64, TargetsEvent)>,
    sender: OperatorSender,
    act: F,
}

impl<F: FnMut(u64, &OperatorSender)> Observer for Seen<F> {
    fn frame(&mut self, record: &FrameRecord) {
        // The time on the host's clock, in place of that since the start.
        let time = record.frame.as_ref().unwrap().time();
        self.records.push(FrameRecord { frame: None, time, ..record.clone() });
        (self.act)(record.number, &self.sender);
    }

    fn event(&mut self, record: &EventRecord) {
        if let RunEvent::Targets(event) = &record.event {
            let time = self.records.last().map_or(0.0, |record| record.time);
            self.events.push((time, event.clone()));
        }
    }
}

impl Outcome {
    pub(crate) fn targets(&self) -> &TargetsSummary {
        self.summary.targets.as_ref().unwrap()
    }

    /// Checks that the run ended well: the board holds the ball at the last place.
    pub(crate) fn check_reached(&self, name: &str) {
        let Summary { reached, at_rest, .. } = &self.summary;
        assert!(*reached && *at_rest, "{name}: {:?}", self.summary);
    }

    /// Returns the largest distance of the true ball from `motion`, metres, in the frames from
    /// `from` to `to` seconds.
    pub(crate) fn farthest(&self, motion: Motion, from: f64, to: f64) -> f64 {
        let within = self.records.iter().filter(|record| (from..to).contains(&record.time));
        let distances = within.map(|it| (it.position().unwrap() - motion(it.time)).norm());
        distances.fold(0.0, f64::max)
    }

    /// Returns the largest speed (m/s) and acceleration (m/s²) of the board's reference over the
    /// time of three frames.
    pub(crate) fn largest_of_reference(&self) -> (f64, f64) {
        let states: Vec<(f64, Vector3<f64>)> = self
            .records
            .iter()
            .filter_map(|record| {
                let board = record.board?;
                Some((board.time, Vector3::from(board.reference?)))
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
    pub(crate) fn farthest_from_reference(&self) -> f64 {
        let distances = self.records.iter().filter_map(|record| {
            let reference = record.board?.reference?;
            Some((record.position()? - Point3::from(reference)).norm())
        });
        distances.fold(0.0, f64::max)
    }

    pub(crate) fn has(&self, wanted: &TargetsEvent) -> bool {
        self.events.iter().any(|(_, event)| event == wanted)
    }
}
