//! The loop over a link that loses, flips, doubles and inserts bytes, from seeds.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use plumb::rig::Rig;
use plumb_emulator::rig::{QuasiStatic, Task};
use plumb_protocol::message::State;
use plumb_tests::bench::bench_over;
use plumb_tests::damage::{Damaged, Rates};

/// Greeting and configuration take fewer bytes than this; they are spared, since they are not repeated.
const SPARED: usize = 200;

/// How a run over a damaged link ended, after at most `frames` pictures.
fn run(rates: Rates, seed: u64, frames: u32) -> (State, f64) {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law.set_gamma(200.0).expect("a gain");
    let task = Task::paper();
    let plant = QuasiStatic::new(task.geometry, task.start).expect("the paper's rig");
    let mut bench = bench_over(&rig, Box::new(plant), |memory| Damaged::new(memory, rates, SPARED, seed))
        .expect("a spared greeting");
    let target = rig.targets().expect("a target")[0];
    // The target or its answer may be lost; it is said again, as a person would.
    let _heard = (0..5).any(|_| bench.link.target(target).is_ok());
    for _ in 0..frames {
        bench.frame(Some).expect("damage is not an error of the link");
        let within = bench.board.borrow().rates().iter().all(|r| r.abs() <= 400.0);
        assert!(within, "seed {seed}: {:?} steps/s", bench.board.borrow().rates());
        if bench.state() != State::Seeking {
            break;
        }
    }
    // Damage in either direction shows: at the board, or as frames that this side dropped.
    let at_board = bench.link.telemetry().map_or(0, |t| u32::from(t.bad_frames));
    assert!(at_board + bench.link.bad_frames() > 0, "seed {seed}: nothing was damaged");
    (bench.state(), (bench.ball() - task.target).norm())
}

#[test]
fn a_link_that_damages_a_byte_in_300_still_reaches() {
    for seed in 0..10 {
        let rates = Rates { lost: 1e-3, flipped: 1e-3, doubled: 5e-4, inserted: 5e-4 };
        let (state, error) = run(rates, seed, 2000);
        assert_eq!(state, State::Holding, "seed {seed}: {error} m");
        assert!(error < 0.010, "seed {seed}: {error} m");
    }
}

/// So much damage that hardly a frame passes: the board may stop by itself, but nothing worse.
#[test]
fn a_link_that_damages_almost_everything_ends_safely() {
    for seed in 0..20 {
        let rates = Rates { lost: 0.02, flipped: 0.05, doubled: 0.01, inserted: 0.02 };
        let (state, error) = run(rates, seed, 300);
        match state {
            // Ready: the target never got through.
            State::Ready | State::Seeking | State::Holding | State::Fault(_) => {}
            other @ State::Unconfigured => panic!("seed {seed}: {other} at {error} m"),
        }
    }
}
