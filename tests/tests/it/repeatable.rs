//! A run in virtual time with rendered pictures is repeatable to the bit.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_emulator::plant::Geometry;
use plumb_log::{FigureSettings, OutputDir, RunLog};
use plumb_runtime::rig::{LawName, Rig};
use plumb_runtime::run::{Run, RunParts, Summary};
use plumb_sim::simulated::VirtualBoard;
use plumb_tests::links::link;
use plumb_vision::detect::DetectorKind;

/// Runs with rendered images, detection and an output folder, in virtual time.
fn run(seed: u64, folder: std::path::PathBuf) -> Summary {
    let mut rig = Rig { law: LawName::Interval.into(), ..Rig::paper().expect("the paper's rig") };
    rig.law.set_gamma(200.0).expect("a gain");
    let camera = camera_file::paper().expect("the paper's camera");
    let board =
        VirtualBoard::paper().expect("the paper's rig").with_wire((link("115200 baud").wire)(seed));
    let motors = *Geometry::paper().motors();
    let mut source = board.camera(&camera, motors, seed).expect("a camera");
    let run = Run::connect(&rig, board.transport()).expect("a configured board");
    let log = RunLog::create(&OutputDir::Path(folder), FigureSettings::of(&rig));
    run.drive(RunParts {
        source: &mut source,
        detector: &mut *DetectorKind::Ball.build(&camera),
        observers: &mut [&mut log.expect("a folder")],
        operator: None,
        timeout: 60.0,
        interrupted: &AtomicBool::new(false),
    })
    .expect("an unbroken run")
}

#[test]
fn the_same_seed_gives_the_same_run_to_the_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, two, other] = [(1, "one"), (1, "two"), (2, "other")].map(|(seed, name)| {
        let summary = run(seed, folder.path().join(name));
        let read = |file: &str| {
            std::fs::read(folder.path().join(name).join(file)).expect("a file of the run")
        };
        (summary, read("run.csv"), read("figure4.svg"), read("figure5.svg"))
    });
    assert!(one.0.reached && one.0.filtered_error_mm.is_some_and(|e| e < 10.0), "{:?}", one.0);
    assert_eq!(one, two);
    assert_ne!(one.1, other.1);
}
