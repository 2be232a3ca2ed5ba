//! Rigs that break in mid-drive are stopped soon; healthy rigs are not (`tests/src/defects.rs`).

use plumb_protocol::message::Fault;
use plumb_runtime::rig::LawName;
use plumb_tests::defects::{Defect, DefectRun, End, Stop};

/// Executes the runs of `defect` with every law on six rigs.
fn runs(defect: Defect) -> impl Iterator<Item = (DefectRun, Stop)> {
    let laws = LawName::ALL.into_iter();
    laws.flat_map(move |law| (0..6).map(move |seed| (law, seed))).map(move |(law, seed)| {
        let run = DefectRun { defect, law, seed, lenient: false };
        (run, run.execute())
    })
}

#[test]
fn healthy_rigs_are_not_stopped() {
    for (run, stop) in runs(Defect::None) {
        assert!(!matches!(stop.end, End::Stopped(_)), "{run:?}: {stop:?}");
    }
}

#[test]
fn a_ball_that_is_caught_stops_the_board_before_the_cables_have_run_out() {
    for (run, stop) in runs(Defect::CaughtBall).filter(|(_, stop)| stop.end != End::RigFailed) {
        assert_eq!(stop.end, End::Stopped(Fault::NotFollowing), "{run:?}: {stop:?}");
        assert!(stop.turn < 700.0, "{run:?}: {stop:?}");
    }
}

#[test]
fn torn_cables_and_swapped_motors_are_noticed() {
    for defect in [Defect::TornCable, Defect::SwappedMotors] {
        for (run, stop) in runs(defect) {
            assert!(stop.end != End::Unnoticed, "{run:?}: {stop:?}");
        }
    }
}

#[test]
fn a_target_out_of_reach_is_given_up() {
    for (run, stop) in runs(Defect::TargetOutside) {
        assert!(stop.end != End::Unnoticed, "{run:?}: {stop:?}");
    }
}
