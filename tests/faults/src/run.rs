//! One run: the host drives from target to target, the faults act, and the end is judged.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use plumb_protocol::units::Micros;

use crate::cause::Cause;
use crate::host::{Ending, live, start_anew};
use crate::kind::Place;
use crate::plan::Plan;
use crate::report::{End, Report};
use crate::world::{Course, Shared, World};

/// Time after a run in which the board must come to rest, µs: longer than its deadlines and a ramp.
const REST_US: u64 = 2_000_000;
/// The same in a short run, µs.
const SHORT_REST_US: u64 = 1_200_000;
/// Time from the end of the faults to the next start, µs.
const PAUSE_US: u64 = 200_000;

/// The cause that is reported is that of the fault.
const TRUE_CAUSE: &str = "a fault is reported with its cause";
/// The board rests after a run.
const AT_REST: &str = "the board rests after a run";
/// The ball moves away from its target by no more than the bound of its faults.
const NEAR: &str = "the ball stays near";
/// After the fault has passed, the board can be used again.
const NEXT_START: &str = "the next start works";

/// Executes the run of a plan on the emulated board.
pub fn on_emulated_board(plan: &Plan) -> Report {
    run(plan, World::emulated(plan))
}

/// Executes the run of a plan on the firmware `image` in the emulated chip.
///
/// # Panics
/// If Node or its packages are missing, or if the image does not start.
pub fn on_chip(plan: &Plan, image: &Path) -> Report {
    run(plan, World::chip(plan, image))
}

fn run(plan: &Plan, world: World) -> Report {
    let world = Rc::new(RefCell::new(world));
    world.borrow_mut().run_to(Micros(10_000 + plan.seed % 20 * 1_700));
    let mut violations = Vec::new();
    let mut ending = Ending::Killed;
    for life in plan.lives() {
        world.borrow_mut().run_to(life.from);
        ending = live(plan, &world, life.to, &mut violations);
        if ending != Ending::Killed {
            break;
        }
    }
    let ended = world.borrow().now();
    let rest = if plan.is_short { SHORT_REST_US } else { REST_US };
    world.borrow_mut().run_to(Micros(ended.0 + rest));
    let course = world.borrow().course();
    world.borrow_mut().close();
    if !world.borrow().is_at_rest() {
        violations.push(format!("{AT_REST}: {:?}", world.borrow().state()));
    }
    let bound_m: f64 = plan.faults.iter().map(|fault| fault.kind.bound_m()).sum();
    if course.away_m > bound_m {
        violations.push(format!("{NEAR}: {:.2} m away, allowed {bound_m:.2} m", course.away_m));
    }
    check_causes(plan, ending, course, ended, &mut violations);
    check_next_start(plan, &world, ending, &mut violations);
    violations.extend(world.borrow().violations());
    report(plan, ending, course, ended, violations)
}

/// Checks that the reported causes are true.
fn check_causes(
    plan: &Plan,
    ending: Ending,
    course: Course,
    ended: Micros,
    violations: &mut Vec<String>,
) {
    let told = match ending {
        Ending::Stopped(cause) => Some(cause),
        _ => None,
    };
    // A host that has ended is silent, and then the board stops for that.
    let fault = course.fault.filter(|(at, _)| *at <= ended);
    let fault = fault.map(|(_, fault)| Cause::Board(fault)).filter(|fault| Some(*fault) != told);
    for cause in told.into_iter().chain(fault) {
        let mut begun = plan.faults.iter().filter(|fault| fault.from <= ended);
        // A target that is not reached in time is one, whatever the reason.
        if cause != Cause::Timeout && !begun.any(|fault| fault.explains(cause)) {
            violations.push(format!("{TRUE_CAUSE}: {cause}"));
        }
    }
}

/// Checks that a new start works, where the faults pass, the rig has none, and the ball is in the
/// workspace.
fn check_next_start(plan: &Plan, world: &Shared, ending: Ending, violations: &mut Vec<String>) {
    let is_whole = plan.faults.iter().all(|f| f.passes() && f.kind.traits().place != Place::Rig);
    if !matches!(ending, Ending::Stopped(_)) || !is_whole || !plan.contains(world.borrow().ball()) {
        return;
    }
    let from = world.borrow().now().0.max(plan.settled().0) + PAUSE_US;
    world.borrow_mut().run_to(Micros(from));
    let ending = start_anew(plan, world, violations);
    if ending != Ending::WentOn {
        violations.push(format!("{NEXT_START}: {ending:?}"));
    }
}

fn report(
    plan: &Plan,
    ending: Ending,
    course: Course,
    ended: Micros,
    violations: Vec<String>,
) -> Report {
    let end = match (ending, course.fault) {
        (Ending::Stopped(cause), _) => End::Stopped(cause),
        (Ending::WentOn, Some((_, fault))) => End::Recovered(Cause::Board(fault)),
        (Ending::WentOn, None) => End::WentOn,
        (Ending::Killed | Ending::Undecided, _) => End::Undecided,
    };
    let detected = match end {
        End::WentOn | End::Undecided => None,
        _ => Some(course.reacted.map_or(ended, |at| at.min(ended))),
    };
    let seconds = |from: Micros, to: Micros| to.since(from) as f64 * 1e-6;
    let began = course.began.unwrap_or(plan.onset());
    Report {
        plan: plan.clone(),
        end,
        detected_s: detected.map(|at| seconds(began, at)),
        stop_s: detected.map(|at| seconds(at, course.stood(at))),
        moved_m: course.moved_m,
        away_m: course.away_m,
        violations,
    }
}
