//! The suite on computed circles.

use super::case::CASES;
use super::knocks;
use super::stand::run;

/// Rays of different moments miss a fast ball; brought to one moment they do not. Where the ball
/// rests, both are the same.
#[test]
fn only_fused_pairs_find_a_fast_ball() {
    let [rest, _, circle, ..] = CASES.map(|case| case);
    let report = run(&circle, 5, 600).unwrap();
    assert!(report.fused.rms_mm < 2.5 && report.fused.consistency < 4.0, "{report:?}");
    assert!(report.newest.rms_mm > 1.5 * report.fused.rms_mm, "{report:?}");
    assert!(report.newest.consistency > 8.0 && report.alarms == 0, "{report:?}");
    let report = run(&rest, 5, 600).unwrap();
    assert!((report.newest.rms_mm - report.fused.rms_mm).abs() < 0.2, "{report:?}");
    assert_eq!(report, run(&rest, 5, 600).unwrap());
    // Every pair of pictures gives one position.
    assert!(report.fused.positions.abs_diff(600) < 5, "{report:?}");
}

/// A camera that turned by 1 degree is off by 9 pixels, far more than its noise.
#[test]
fn turned_cameras_are_told() {
    let report = knocks::run(3, 300).unwrap();
    assert!(report.harmful >= 5 && report.told + 1 >= report.harmful, "{report:?}");
    assert_eq!((report.misnamed, report.false_alarms), (0, 0), "{report:?}");
}
