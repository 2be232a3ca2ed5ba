//! Closed loops over a link that loses, damages and duplicates frames, with seeds.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use plumb_emulator::Wire;
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::wire::Lane;
use plumb_protocol::message::State;
use plumb_protocol::units::Micros;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::{LawName, Rig};
use plumb_tests::bench::{Bench, bench};

/// Connects to a board with the paper's rig behind `wire` and configures it.
fn configured(rig: &Rig, wire: Wire) -> Bench {
    let task = Task::paper();
    let plant = QuasiStatic::new(task.geometry, task.start).expect("the paper's rig");
    bench(rig, Box::new(plant), wire).expect("a configured board")
}

fn rig() -> Rig {
    let paper = Rig::paper().expect("the paper's rig file");
    let mut rig = Rig { law: LawName::Interval.into(), ..paper };
    rig.law.set_gamma(200.0).expect("a gain");
    rig
}

/// Time in which a board without a host comes to rest, µs: twice its deadline and a ramp.
const REST_US: u64 = 1_000_000;

/// Returns the final state and error, m, of a run of at most `frames` frames. The run ends early if
/// the board does not answer.
fn run(mut bench: Bench, seed: u64, frames: u32) -> (State, f64) {
    for _ in 0..frames {
        match bench.frame(Some) {
            Ok(()) => {}
            Err(
                LinkError::Silent { .. }
                | LinkError::NoTelemetry { .. }
                | LinkError::Lagging { .. },
            ) => {
                let end = Micros(bench.board.borrow().now().0 + REST_US);
                bench.board.borrow_mut().run_to(end).expect("a rig that follows");
                assert_eq!(bench.board.borrow().rates(), [0.0; 3], "seed {seed}");
                break;
            }
            Err(other) => panic!("seed {seed}: {other}"),
        }
        let within = bench.board.borrow().rates().iter().all(|r| r.abs() <= 400.0);
        assert!(within, "seed {seed}: {:?} steps/s", bench.board.borrow().rates());
        if bench.state() != State::Seeking {
            break;
        }
    }
    let [to_board, to_host] = bench.board.borrow().traffic().expect("a wire");
    assert!(to_board.damaged + to_host.damaged > 0, "seed {seed}: nothing was damaged");
    (bench.state(), (bench.ball() - Task::paper().target).norm())
}

#[test]
fn a_link_that_damages_a_frame_in_14_still_reaches() {
    for seed in 0..10 {
        let rig = rig();
        let lane = Lane { lost: 0.01, damaged: 0.07, doubled: 0.01, ..Lane::default() };
        let mut bench = configured(&rig, Wire::symmetric(lane, seed));
        bench
            .link
            .set_target(rig.targets().expect("a target")[0])
            .expect("a target inside the workspace");
        let (state, error) = run(bench, seed, 2000);
        assert_eq!(state, State::Holding, "seed {seed}: {error} m");
        assert!(error < 0.010, "seed {seed}: {error} m");
    }
}

/// Almost no frame passes: the board stops by itself or does not start.
#[test]
fn a_link_that_damages_almost_everything_ends_safely() {
    for seed in 0..20 {
        let rig = rig();
        let mut bench = configured(&rig, Wire::default());
        let lane = Lane { lost: 0.1, damaged: 0.85, doubled: 0.05, ..Lane::default() };
        bench.board.borrow_mut().set_wire(Wire::symmetric(lane, seed));
        let accepted = bench.link.set_target(rig.targets().expect("a target")[0]).is_ok();
        let (state, error) = run(bench, seed, 300);
        match state {
            // The target was lost.
            State::Ready | State::Stopping => assert!(!accepted, "seed {seed}"),
            State::Fault(_) => {}
            other => panic!("seed {seed}: {other} at {error} m"),
        }
    }
}
