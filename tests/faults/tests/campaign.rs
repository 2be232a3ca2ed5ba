//! A short campaign: every kind of fault, alone and two at once. `make faults` runs 10 000 seeds.

use plumb_faults::cause::Cause;
use plumb_faults::kind::{KINDS, Kind};
use plumb_faults::plan::Plan;
use plumb_faults::report::{End, Report};
use plumb_faults::run::{on_chip, on_emulated_board};
use plumb_tests::chip::firmware_image;
use plumb_tests::is_long;

/// Runs of each kind of fault.
const RUNS: u64 = 8;

#[test]
fn no_fault_breaks_an_invariant() {
    let reports = (0..RUNS * KINDS.len() as u64).map(|seed| on_emulated_board(&Plan::draw(seed)));
    let broken: Vec<String> = reports.filter(|report| !report.is_good()).map(describe).collect();
    assert!(broken.is_empty(), "{} runs:\n{}", broken.len(), broken.join("\n"));
}

/// The same faults on a rig of two motors.
#[test]
fn no_fault_breaks_an_invariant_with_two_motors() {
    let runs = if is_long() { 100 } else { 2 };
    let seeds = 0..runs * KINDS.len() as u64;
    let reports = seeds.map(|seed| on_emulated_board(&Plan::draw_planar(seed)));
    let broken: Vec<String> = reports.filter(|report| !report.is_good()).map(describe).collect();
    assert!(broken.is_empty(), "{} runs:\n{}", broken.len(), broken.join("\n"));
}

fn describe(report: Report) -> String {
    let (end, violations) = (report.end, report.violations.join("; "));
    format!("{}: {end:?}: {violations}\n  {}", report.faults(), report.command())
}

/// Faults of the link, the host and the power on the firmware itself.
#[test]
fn no_fault_breaks_an_invariant_of_the_chip() {
    let Some(image) = firmware_image() else { return };
    let plans = [6, 30, 33, 34, 35].map(Plan::draw_short);
    let reports = plans.iter().map(|plan| on_chip(plan, &image));
    let broken: Vec<String> = reports.filter(|report| !report.is_good()).map(describe).collect();
    assert!(broken.is_empty(), "{} runs:\n{}", broken.len(), broken.join("\n"));
}

#[test]
fn the_same_seed_gives_the_same_run() {
    for seed in [2, 10, 37] {
        let reports = [(); 2].map(|()| format!("{:?}", on_emulated_board(&Plan::draw(seed))));
        assert_eq!(reports[0], reports[1]);
    }
}

#[test]
fn a_fault_that_cannot_be_borne_stops_every_run() {
    for kind in [Kind::Unplugged, Kind::CameraGone, Kind::WrongVersion] {
        for seed in 0..5 {
            let report = on_emulated_board(&Plan::draw_single(seed, kind));
            assert!(matches!(report.end, End::Stopped(_)), "{report:?}");
        }
    }
}

#[test]
fn a_camera_that_repeats_its_picture_is_told_as_one() {
    for seed in 0..8 {
        let report = on_emulated_board(&Plan::draw_single(seed, Kind::FrozenPicture));
        assert!(report.is_good(), "{report:?}");
        assert_eq!(report.end, End::Stopped(Cause::RepeatedPicture), "{report:?}");
        assert!(report.away_m < 0.15, "{report:?}");
    }
}
