//! Closed loops in virtual time, over links with delay and loss: Jacobians of the law's family,
//! random rigs, and rigs with wiring faults.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::{Matrix3, Point3, Vector3};

use plumb_emulator::Wire;
use plumb_emulator::plant::{
    CameraMonitor, Elastic, ElasticParameters, PlanarPopulation, Plant, Population, QuasiStatic,
    RigError, Task,
};
use plumb_protocol::config::SIGNS;
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Point;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_sim::simulated::SimulationError;
use plumb_tests::bench::{Bench, RATE_HZ, bench};
use plumb_tests::links::{link, usable_links};
use plumb_tests::planar::{LAWS, planar_rig, planar_task};
use plumb_tests::plants::{Linear, Miswired};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Returns the paper's rig file with another gain.
fn rig(gamma: f64) -> Rig {
    let paper = Rig::paper().expect("the paper's rig file");
    let mut rig = Rig { law: LawName::Interval.into(), ..paper };
    rig.law.set_gamma(gamma).expect("a gain");
    rig
}

/// Removes the limits of a rig's size: another rig moves.
fn lift_size_limits(rig: &mut Rig) {
    rig.motors.travel = [-60_000.0, 60_000.0].map(|t| t.try_into().expect("a travel"));
    rig.workspace.min = [-3.0; 3].map(|c| c.try_into().expect("a corner"));
    rig.workspace.max = [3.0; 3].map(|c| c.try_into().expect("a corner"));
}

fn paper_plant() -> QuasiStatic {
    let task = Task::paper();
    QuasiStatic::new(task.geometry, task.start).expect("the paper's rig")
}

/// Links with delay and without loss.
const PACED: [&str; 7] =
    ["ideal", "115200 baud", "921600 baud", "0.3 ms", "0.5 ms", "1 ms", "2 ms"];

/// Returns the wire of run `index`: the links of [`PACED`] in turn.
fn paced(index: usize) -> Wire {
    (link(PACED[index % PACED.len()]).wire)(index as u64)
}

/// Returns the wire of run `index`: the usable links in turn, with loss too.
fn usable(index: usize) -> Wire {
    let links = usable_links();
    (links[index % links.len()].wire)(index as u64)
}

/// Returns a bench that seeks the first target of its rig file.
fn seeking(rig: &Rig, plant: Box<dyn Plant + Send>, wire: Wire) -> Bench {
    let mut bench = bench(rig, plant, wire).expect("a configured board");
    let targets = rig.targets().expect("targets in the wire's range");
    bench.link.set_target(targets[0]).expect("a target inside the workspace");
    bench
}

/// Theorem 1 on the whole board: for any J of the family |e| never grows, and the ball reaches its
/// target.
#[test]
fn the_error_never_grows_for_any_jacobian_of_the_family() {
    let mut random = ChaCha8Rng::seed_from_u64(13);
    for run in 0..40 {
        let mut rig = rig(20.0);
        let LawSettings::Interval { alpha, beta, .. } = &mut rig.law else { panic!() };
        (*alpha, *beta) = (0.05.try_into().expect("α"), 0.5.try_into().expect("β"));
        lift_size_limits(&mut rig);
        // The theorem has no ramps, so that the limits must not be active.
        rig.motors.max_rate = 4000.0.try_into().expect("a rate");
        rig.motors.max_acceleration = 400_000.0.try_into().expect("an acceleration");
        let jacobian =
            Matrix3::from_fn(|i, k| f64::from(SIGNS[i][k]) * random.random_range(0.05..0.5));
        let start = Point3::new(0.5, 0.3, 0.3);
        let mut bench =
            seeking(&rig, Box::new(Linear::new(jacobian, 0.000_471, start)), paced(run));
        let target = Point3::new(0.4, 0.4, 0.15);
        let (mut error, mut frames) = ((start - target).norm(), 0);
        while bench.state() != State::Holding {
            bench.frame(Some).expect("an intact link");
            let now = (bench.ball() - target).norm();
            // A microstep of cable is 29 µm, and the rates are rounded to 1/256 step/s.
            assert!(
                now <= error + 40e-6,
                "run {run}, frame {frames}: {error} -> {now} with J = {jacobian}"
            );
            (error, frames) = (now, frames + 1);
            assert!(frames < 5000, "run {run} is not reached: {error} m with J = {jacobian}");
        }
        assert!(error < 0.010, "run {run} ended at {error} m");
    }
}

/// Drives until the target is reached, with a camera that has noise, latency and drop-outs.
fn drive_with_noise(bench: &mut Bench, seed: u64, name: &str) {
    let mut observer = CameraMonitor::new(Default::default(), seed).expect("an observer");
    for frame in 0u32.. {
        let time = f64::from(frame) / RATE_HZ as f64;
        let measure = |ball| {
            observer.observe(time, ball);
            observer.delivered(time).and_then(|o| o.position)
        };
        bench.frame(measure).expect("an intact link");
        match bench.state() {
            State::Holding => break,
            State::Seeking => assert!(frame < 3000, "{name} is not reached: {:?}", bench.ball()),
            other => panic!("{name}, frame {frame}: {other}"),
        }
    }
}

/// Random rigs with noise, latency and drop-outs reach their targets without a fault.
#[test]
fn random_rigs_reach_their_targets_with_a_noisy_camera() {
    for index in 0..20 {
        let task = Population::default().sample(3, index).expect("a random rig");
        let mut rig = rig(300.0);
        lift_size_limits(&mut rig);
        rig.set_targets(&[task.target.into()]).expect("a target");
        let plant = QuasiStatic::new(task.geometry, task.start).expect("a plant");
        let mut bench = seeking(&rig, Box::new(plant), usable(index as usize));
        drive_with_noise(&mut bench, index, &format!("rig {index}"));
        let error = (bench.ball() - task.target).norm();
        assert!(error < 0.010, "rig {index} reports its target as reached at {error} m");
    }
}

/// Returns every exchange of two or three motors, and every reversal: the board's motor for each
/// pulley, and its sign.
fn miswirings() -> impl Iterator<Item = ([usize; 3], [f64; 3])> {
    let orders =
        [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]].map(|order| (order, [1.0; 3]));
    let signs = (1..8)
        .map(|bits| ([0, 1, 2], [0, 1, 2].map(|i| if bits >> i & 1 == 1 { -1.0 } else { 1.0 })));
    orders.into_iter().chain(signs)
}

/// Drives every miswired rig and checks that the board stops by itself before the ball is far away.
/// Calls `target` before each frame with its number.
fn assert_miswired_rigs_stop(target: impl Fn(&mut Bench, u32)) {
    let mut jams = 0;
    for (index, (order, signs)) in miswirings().enumerate() {
        let plant = Miswired { plant: paper_plant(), order, signs };
        let mut bench = seeking(&rig(100.0), Box::new(plant), usable(index));
        let (mut worst, mut jam) = (0.0_f64, None);
        let start = (bench.ball() - Task::paper().target).norm();
        for frame in 0..2000 {
            target(&mut bench, frame);
            jam = bench.frame(Some).err();
            if jam.is_some() || !matches!(bench.state(), State::Seeking) {
                break;
            }
            worst = worst.max((bench.ball() - Task::paper().target).norm());
        }
        if let Some(LinkError::Other(jam)) = jam {
            // Lost positions delay the guard; until then the motors wind against each other.
            let is_short = matches!(
                jam.downcast_ref(),
                Some(SimulationError::Rig(RigError::TooShortTogether { .. }))
            );
            assert!(is_short && worst < start + 0.25, "{order:?} {signs:?}: {jam}, {worst} m");
            jams += 1;
            continue;
        }
        let State::Fault(fault) = bench.state() else {
            panic!("{order:?} {signs:?}: {}", bench.state())
        };
        assert!(
            matches!(
                fault,
                Fault::ErrorGrowing | Fault::NotFollowing | Fault::BallOutside | Fault::Travel(_)
            ),
            "{order:?} {signs:?}: {fault}"
        );
        assert!(
            worst < start + 0.25,
            "{order:?} {signs:?}: the ball was {worst} m away before {fault}"
        );
    }
    assert!(jams <= 1, "{jams} rigs jammed");
}

#[test]
fn a_miswired_rig_stops_by_itself() {
    assert_miswired_rigs_stop(|_, _| {});
}

/// A new target with every frame, on a circle of 3 cm at 10 cm/s.
#[test]
fn a_miswired_rig_with_a_moving_target_stops_by_itself() {
    assert_miswired_rigs_stop(|bench, frame| {
        let angle = f64::from(frame) / RATE_HZ as f64 * 0.10 / 0.03;
        let target = Task::paper().target + Vector3::new(angle.cos(), angle.sin(), 0.0) * 0.03;
        let target = Point::from_metres(target.into()).expect("a point in the workspace");
        bench.link.request_target(target).expect("an intact link");
    });
}

#[test]
fn a_silent_host_stops_the_rig() {
    let mut bench = seeking(&rig(100.0), Box::new(paper_plant()), (link("2 ms").wire)(0));
    for _ in 0..30 {
        bench.frame(Some).expect("an intact link");
    }
    assert!(bench.board.borrow().rates().iter().any(|r| *r != 0.0));
    // 300 ms of silence and a ramp of 400/2000 s.
    let now = bench.board.borrow().now();
    bench
        .board
        .borrow_mut()
        .run_to(plumb_protocol::units::Micros(now.0 + 501_000))
        .expect("a rig that follows");
    assert_eq!(bench.state(), State::Fault(Fault::HostSilent));
    assert_eq!(bench.board.borrow().rates(), [0.0; 3]);
}

/// Law `interval` reaches the target on an elastic rig, with a gain that does not excite it.
#[test]
fn the_elastic_rig_is_reached() {
    let task = Task::paper();
    let plant = Elastic::new(task.geometry, ElasticParameters::default(), task.start)
        .expect("an elastic rig");
    let mut bench = seeking(&rig(60.0), Box::new(plant), (link("1 ms").wire)(0));
    for frame in 0.. {
        bench.frame(Some).expect("an intact link");
        if bench.state() == State::Holding {
            break;
        }
        assert!(
            frame < 3000 && bench.state() == State::Seeking,
            "frame {frame}: {}",
            bench.state()
        );
    }
}

/// Drives a planar rig over the usable link number `index`, with a noisy camera that also measures
/// x, to the target of its rig file.
fn assert_reached_in_plane(rig: &Rig, task: &Task, index: usize) {
    let law = rig.law.name();
    let plant = QuasiStatic::new(task.geometry, task.start).expect("a plant");
    let mut bench = seeking(rig, Box::new(plant), usable(index));
    drive_with_noise(&mut bench, index as u64, &format!("{law}, rig {index}"));
    let (error, x) = ((bench.ball() - task.target).norm(), bench.ball().x);
    assert!(error < 0.010 && x == 0.0, "{law}, rig {index}: {error} m, x = {x} m");
    let telemetry = bench.link.telemetry().expect("telemetry");
    assert_eq!([telemetry.motors.len(), telemetry.rates.len()], [2; 2], "{law}, rig {index}");
    assert_eq!(telemetry.error.micrometres()[0], 0, "{law}, rig {index}");
}

#[test]
fn two_motors_reach_their_target_in_the_plane_with_every_law() {
    for law in LAWS {
        assert_reached_in_plane(&planar_rig(law), &planar_task(), 0);
        for index in 1..8 {
            let task = PlanarPopulation::default().sample(3, index).expect("a random rig");
            let mut rig = planar_rig(law);
            lift_size_limits(&mut rig);
            for corner in [&mut rig.workspace.min, &mut rig.workspace.max] {
                corner[0] = 0.0.try_into().expect("a corner");
            }
            rig.set_targets(&[task.target.into()]).expect("a target");
            assert_reached_in_plane(&rig, &task, index as usize);
        }
    }
}

/// The target (0.4, -0.1, 0.3) m is outside the triangle of the paper's motors. Without the guard
/// motor A pays out 3000 steps (1.4 m) in 6 s, to the end of its travel.
#[test]
fn a_target_outside_the_triangle_does_not_pay_a_cable_out() {
    for law in LawName::ALL {
        let mut rig = Rig { law: law.into(), ..Rig::paper().expect("the paper's rig file") };
        rig.set_targets(&[[0.4, -0.1, 0.3]]).expect("a target");
        rig.workspace.min = [-0.2, -0.2, -0.1].map(|c| c.try_into().expect("a corner"));
        rig.motors.travel = [-3000.0, 3000.0].map(|t| t.try_into().expect("a travel"));
        let mut bench = seeking(&rig, Box::new(paper_plant()), usable(0));
        let mut frames = 0;
        while bench.state() == State::Seeking {
            let _ = bench.frame(Some);
            frames += 1;
            assert!(frames < 900, "{law}: no stop within 30 s");
        }
        let motors = bench.board.borrow().motors();
        assert_eq!(bench.state(), State::Fault(Fault::NotFollowing), "{law}: {motors:?}");
        assert!(motors.iter().all(|motor| motor.abs() < 2000.0), "{law}: {motors:?}");
    }
}
