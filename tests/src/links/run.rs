//! One run over a link, and its observation from outside.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_config::error_chain::ErrorChain;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, Served, serve};
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;
use plumb_runtime::link::{Serial, Transport};
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunError, RunParts, Summary};
use plumb_sim::simulated::{ServedRig, SimClock, Timing};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{FixedDetector, LinkCase, TrackingCamera};

/// Number of targets of a run.
const TARGETS: usize = 3;
/// Minimum distance between consecutive targets, m. A leg that was not driven ends this far off.
const APART_M: f64 = 0.12;
/// Gain of law `interval`, 1/s. The paper's, 30, takes minutes for some of the targets.
const GAMMA: f64 = 200.0;
/// Timeout for a target, s.
const TIMEOUT_S: f64 = 60.0;
/// Time after a run in which the board must come to rest: longer than its deadline and a ramp.
const REST: Duration = Duration::from_secs(2);

/// Settings of a run.
#[derive(Debug, Clone, Copy)]
pub struct LinkRun {
    /// The link.
    pub link: LinkCase,
    /// The law.
    pub law: LawName,
    /// Seed of the link's faults, of the targets and of the time of the first frame.
    pub seed: u64,
}

/// Observation of one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// The target, m.
    pub target: Point3<f64>,
    /// Number of frames.
    pub frames: u64,
    /// Distance of the simulated ball from the target at the last frame, m.
    pub true_error_m: f64,
    /// Whether the run reports the target as reached.
    pub reported_reached: bool,
}

/// Observation of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The targets that the run started, in order.
    pub legs: Vec<Leg>,
    /// Number of targets of the run.
    pub targets: usize,
    /// Exit code of `plumb run` for this result.
    pub exit_code: u8,
    /// Reported cause of the end.
    pub cause: String,
    /// Time of the end on the board's clock.
    pub ended_at: Micros,
    /// State of the board 2 s after the end.
    pub state: State,
    /// Whether the motors were at rest then.
    pub at_rest: bool,
}

/// Runs in virtual time, with the board in memory.
///
/// # Panics
/// If the run cannot be prepared.
pub fn in_virtual_time(run: &LinkRun) -> Outcome {
    let rig = rig(run);
    let simulated = run.link.paper_board(run.seed);
    let board = simulated.board();
    let rest = || {
        let now = board.borrow().now();
        let end = Micros(now.0 + REST.as_micros() as u64);
        board.borrow_mut().run_to(end).expect("a rig that follows");
    };
    drive(&rig, simulated.rig(), simulated.transport(), board, rest)
}

/// Runs in real time, with the board on a pseudo-terminal. The board's deadlines are long, so that
/// a delay of a busy machine does not look like a silent host.
///
/// # Panics
/// If the run cannot be prepared.
pub fn in_real_time(run: &LinkRun) -> Outcome {
    let mut rig = rig(run);
    let deadline = |seconds: f64| seconds.try_into().expect("seconds");
    rig.deadlines.host = deadline(5.0);
    rig.deadlines.position = deadline(5.0);
    rig.deadlines.max_age = deadline(2.0);
    let task = Task::paper();
    let plant = Box::new(QuasiStatic::new(task.geometry, task.start).expect("the paper's rig"));
    let board = EmulatedBoard::with_plant(EMULATED, plant).with_wire((run.link.wire)(run.seed));
    let served = Arc::new(serve(board).expect("a pseudo-terminal"));
    let port = served.path().to_string_lossy().into_owned();
    let transport = Serial::open(&port, rig.board.baud).expect("the board's port");
    let simulated = ServedRig::new(Arc::clone(&served)).expect("a board with a rig");
    let rest = || {
        let end = served.board().now().0 + REST.as_micros() as u64;
        while served.board().now().0 < end {
            thread::sleep(Duration::from_millis(20));
        }
    };
    drive(&rig, simulated, transport, &served, rest)
}

/// Access to the emulated board of a run.
trait Probe {
    fn inspect<R>(&self, at: impl FnOnce(&EmulatedBoard) -> R) -> R;
}

impl Probe for Rc<RefCell<EmulatedBoard>> {
    fn inspect<R>(&self, at: impl FnOnce(&EmulatedBoard) -> R) -> R {
        at(&self.borrow())
    }
}

impl Probe for Arc<Served> {
    fn inspect<R>(&self, at: impl FnOnce(&EmulatedBoard) -> R) -> R {
        at(&self.board())
    }
}

/// Returns the paper's rig with the run's law and targets.
fn rig(run: &LinkRun) -> Rig {
    let mut law = LawSettings::from(run.law);
    if run.law == LawName::Interval {
        law.set_gamma(GAMMA).expect("a gain");
    }
    let targets = targets(run.seed).map(|target| {
        let coordinates: [f64; 3] = target.into();
        coordinates.map(|c| c.try_into().expect("a finite coordinate"))
    });
    Rig { law, targets: targets.into(), ..Rig::paper().expect("the paper's rig file") }
}

/// Returns random targets in the middle of the workspace, at least [`APART_M`] apart.
fn targets(seed: u64) -> [Point3<f64>; TARGETS] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut last = Task::paper().start;
    [(); TARGETS].map(|()| {
        loop {
            let mut between = |low: f64, high: f64| random.random_range(low..high);
            let target = Point3::new(between(0.4, 0.65), between(0.2, 0.4), between(0.15, 0.45));
            if (target - last).norm() >= APART_M {
                last = target;
                return target;
            }
        }
    })
}

/// Runs the control loop and inspects the board at each frame and, after `rest`, at the end.
fn drive<C: SimClock, T: Transport>(
    rig: &Rig,
    simulated: C,
    transport: T,
    board: &impl Probe,
    rest: impl FnOnce(),
) -> Outcome {
    let camera = camera_file::paper().expect("the paper's camera");
    let mut source = TrackingCamera::new(simulated, camera.clone(), Timing::default());
    let mut observer = LegObserver { legs: Vec::new(), board };
    let result = Run::connect(rig, transport).and_then(|run| {
        run.drive(RunParts {
            source: &mut source,
            detector: &mut FixedDetector(camera.clone()),
            observers: &mut [&mut observer],
            operator: None,
            timeout: TIMEOUT_S,
            interrupted: &AtomicBool::new(false),
        })
    });
    let mut legs = observer.legs;
    let ended_at = board.inspect(EmulatedBoard::now);
    let Report { reported_reached, exit_code, cause } = report(&result);
    for leg in legs.iter_mut().take(reported_reached) {
        leg.reported_reached = true;
    }
    rest();
    let (state, rates) = board.inspect(|b| (b.state(), b.rates()));
    let at_rest = rates == [0.0; 3];
    Outcome { legs, targets: rig.targets.len(), exit_code, cause, ended_at, state, at_rest }
}

/// Observer that inspects the board at each frame.
struct LegObserver<'a, P> {
    legs: Vec<Leg>,
    board: &'a P,
}

impl<P: Probe> Observer for LegObserver<'_, P> {
    fn frame(&mut self, record: &FrameRecord) {
        let Some(target) = record.target else { return };
        let legs = &mut self.legs;
        if legs.last().is_none_or(|leg| leg.target != target) {
            legs.push(Leg { target, frames: 0, true_error_m: 0.0, reported_reached: false });
        }
        if let Some(leg) = legs.last_mut() {
            let ball = self.board.inspect(|board| board.ball()).expect("a rig");
            leg.frames += 1;
            leg.true_error_m = (ball - target).norm();
        }
    }
}

/// The result that `plumb run` reports to its user.
struct Report {
    /// Number of targets reported as reached, from the first.
    reported_reached: usize,
    exit_code: u8,
    cause: String,
}

/// Converts the result as `plumb run` does.
fn report(result: &Result<Summary, RunError>) -> Report {
    let reported_reached = |summary: &Summary| summary.targets_reached;
    match result {
        Ok(summary) => Report {
            reported_reached: reported_reached(summary),
            exit_code: u8::from(!summary.reached),
            cause: summary.ending.to_string(),
        },
        Err(error) => match error {
            RunError::Broken { error, summary } => Report {
                reported_reached: reported_reached(summary),
                exit_code: 1,
                cause: ErrorChain(error).to_string(),
            },
            RunError::Connect(error) => {
                Report { reported_reached: 0, exit_code: 1, cause: ErrorChain(error).to_string() }
            }
            _ => Report { reported_reached: 0, exit_code: 2, cause: ErrorChain(error).to_string() },
        },
    }
}
