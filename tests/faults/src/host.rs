//! The host of a run: its lives, and what it reports against what is true.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_frame::source::BoxedError;
use plumb_protocol::units::Micros;
use plumb_runtime::link::Link;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, PathPoint, RunEvent};
use plumb_runtime::run::{Run, RunError, RunParts, StopReason, Summary, Waypoint};
use plumb_tests::links::FixedDetector;

use crate::cause::Cause;
use crate::kind::{Kind, Place};
use crate::plan::{Goal, Plan};
use crate::world::{FaultyCamera, Port, Shared};

/// Longest drive to a target, s.
const TIMEOUT_S: f64 = 60.0;
/// Time after the faults in which a run must be decided, µs: that of three targets.
const DECIDED_US: u64 = 200_000_000;
/// Time after the faults for which a short run must go on, µs.
const SHORT_US: u64 = 1_000_000;
/// Targets to be reached with a fault that lasts, before it counts as borne.
const BORNE_TARGETS: usize = 3;
/// Time of a path to be covered after the faults, s.
const FOLLOWED_S: f64 = 2.0;
/// The same with a fault that lasts, before it counts as borne, s.
const BORNE_S: f64 = 20.0;
/// Room for the noise of the camera, m.
const NOISE_M: f64 = 0.005;
/// Largest distance of the ball from a target that is reported as reached, m: the radius of the rig
/// file, and the noise of the camera.
const REACHED_M: f64 = 0.01 + NOISE_M;

/// A target that was reported as reached is reached.
const TRUE_REACHED: &str = "a reached target is reached";
/// The ball is near a path that waits for it and goes on.
const TRUE_FOLLOWED: &str = "the ball is near a path that waits for it";

/// End of a life of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending {
    /// The run stopped for this cause.
    Stopped(Cause),
    /// The host was killed.
    Killed,
    /// The run went on and reached targets after the faults.
    WentOn,
    /// Neither, and time was up.
    Undecided,
}

/// Drives to the targets of the plan or along its path, again and again, until the run is decided,
/// or the host is killed at `killed`. Broken invariants are added to `violations`.
pub(crate) fn live(
    plan: &Plan,
    world: &Shared,
    killed: Option<Micros>,
    violations: &mut Vec<String>,
) -> Ending {
    let mut watch = Watch::new(plan, world);
    let result = drive(plan, world, killed, &mut watch);
    violations.append(&mut watch.violations);
    match Cause::of(&result) {
        Some(Cause::Other) if killed.is_some_and(|at| at <= world.borrow().now()) => Ending::Killed,
        Some(cause) => Ending::Stopped(cause),
        None if watch.is_decided => Ending::WentOn,
        None => Ending::Undecided,
    }
}

fn drive(
    plan: &Plan,
    world: &Shared,
    killed: Option<Micros>,
    watch: &mut Watch,
) -> Result<Summary, RunError> {
    let camera = camera_file::paper().expect("the paper's camera");
    let mut run = Run::connect(&plan.rig(), Port::open(world.clone(), killed))?;
    match plan.path() {
        Some(path) => run.set_path(path)?,
        None => {
            let targets = plan.targets.iter().map(|target| Waypoint::new((*target).into()));
            run.set_waypoints(&targets.collect::<Vec<Waypoint>>(), true)?;
        }
    }
    let interrupted = Rc::clone(&watch.interrupted);
    run.drive(RunParts {
        source: &mut FaultyCamera::new(world, &camera),
        detector: &mut FixedDetector(camera.clone()),
        observers: &mut [watch],
        operator: None,
        timeout: TIMEOUT_S,
        interrupted: &interrupted,
    })
}

/// Clears the fault of the board, as `plumb clear` does, and drives to a target.
pub(crate) fn start_anew(plan: &Plan, world: &Shared, violations: &mut Vec<String>) -> Ending {
    let cleared =
        Link::connect(Port::open(world.clone(), None)).and_then(|mut link| link.clear_fault());
    match cleared {
        Ok(()) => live(plan, world, None, violations),
        Err(error) => Ending::Stopped(Cause::of_link(&error)),
    }
}

/// Observer that compares what is reported with the world, and ends the run once it is decided.
struct Watch {
    plan: Plan,
    world: Shared,
    interrupted: Rc<AtomicBool>,
    /// Start of the present drive.
    began: Micros,
    target: Point3<f64>,
    /// Targets that were reached with all faults acting or over.
    reached: usize,
    /// The path's time at the first picture with all faults acting or over, s.
    followed_from: Option<f64>,
    is_decided: bool,
    /// Whether the disk was reported as full.
    is_full: Cell<bool>,
    violations: Vec<String>,
}

impl Watch {
    fn new(plan: &Plan, world: &Shared) -> Self {
        Self {
            plan: plan.clone(),
            world: world.clone(),
            interrupted: Rc::new(AtomicBool::new(false)),
            began: Micros(0),
            target: Point3::origin(),
            reached: 0,
            followed_from: None,
            is_decided: false,
            is_full: Cell::new(false),
            violations: Vec::new(),
        }
    }

    fn now(&self) -> Micros {
        self.world.borrow().now()
    }

    /// Returns whether the camera shows where the ball is, and nothing but the motors moves it. A
    /// camera with a fault may see the ball at the target, and a hand may hold it elsewhere.
    fn is_seen_truly(&self) -> bool {
        let now = self.now();
        self.plan.faults.iter().all(|fault| {
            let place = fault.kind.traits().place;
            !matches!(place, Place::Camera | Place::Rig) || now < fault.from
        })
    }

    fn has_lasting_fault(&self) -> bool {
        self.plan.faults.iter().any(|fault| !fault.passes())
    }

    /// Checks that the ball is within `limit_m` of `place`, m.
    fn check_near(&mut self, rule: &str, place: Point3<f64>, limit_m: f64) {
        let away = (self.world.borrow().ball() - place).norm();
        if self.is_seen_truly() && away > limit_m {
            self.violations.push(format!("{rule}: {:.1} mm away", away * 1e3));
        }
    }

    /// Takes in a target that is reported as reached.
    fn note_reached(&mut self) {
        self.check_near(TRUE_REACHED, self.target, REACHED_M);
        if self.plan.goal != Goal::Targets {
            // The start of the path.
            return;
        }
        if self.began >= self.plan.settled() {
            self.reached += 1;
        }
        self.is_decided |= self.reached >= if self.has_lasting_fault() { BORNE_TARGETS } else { 1 };
    }

    /// Takes in the place of the path at a picture.
    fn note_path(&mut self, point: &PathPoint) {
        self.world.borrow_mut().move_target(point.position);
        if self.now() < self.plan.settled() {
            return;
        }
        let from = *self.followed_from.get_or_insert(point.time);
        let enough = if self.has_lasting_fault() { BORNE_S } else { FOLLOWED_S };
        if point.time - from < enough {
            return;
        }
        self.is_decided = true;
        if self.plan.goal.waits() {
            let limit_m = self.plan.rig().path.deviation.get() + NOISE_M;
            self.check_near(TRUE_FOLLOWED, point.position, limit_m);
        }
    }
}

impl Observer for Watch {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(point) = &record.path {
            self.note_path(point);
        }
        let since = self.now().since(self.plan.settled());
        self.is_decided |= self.plan.is_short && since > SHORT_US;
        let is_late = since > DECIDED_US;
        if self.is_decided || is_late {
            self.interrupted.store(true, Ordering::Relaxed);
        }
    }

    fn event(&mut self, record: &EventRecord) {
        match &record.event {
            RunEvent::TargetSet { target, .. } => {
                (self.began, self.target) = (self.now(), *target);
                self.world.borrow_mut().set_target(*target);
            }
            RunEvent::TargetEnded { reason: StopReason::Reached, .. } => self.note_reached(),
            _ => {}
        }
    }

    fn failure(&mut self) -> Option<BoxedError> {
        let now = self.now();
        let is_full = |fault: &crate::plan::Fault| fault.kind == Kind::DiskFull && fault.acts(now);
        if self.is_full.get() || !self.plan.faults.iter().any(is_full) {
            return None;
        }
        self.is_full.set(true);
        Some("run.csv: no space left on device".into())
    }
}
