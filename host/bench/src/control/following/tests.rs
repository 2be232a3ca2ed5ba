use super::*;

/// Follows the paths of the first `rigs` rigs of seed 11.
fn quick(name: &str, suite: PathSuite, rigs: u64) -> Vec<PathReport> {
    let controller: ControllerKind = name.parse().unwrap();
    follow_paths(&controller, suite, 0..rigs, 11, &mut |_| ()).unwrap()
}

/// Checks that no run is lost, and that rms is within these bounds, mm, at 2, 5 and 10 cm/s in the
/// median.
fn check(name: &str, suite: PathSuite, bounds_mm: [f64; 3]) {
    for (report, bound_mm) in quick(name, suite, 3).iter().zip(bounds_mm) {
        assert_eq!(report.lost, 0, "{report} {:?}", report.losses);
        assert!(report.rms_mm.median <= bound_mm && report.kept > 0.9, "{report}");
        assert!(report.cross_mm.median <= report.rms_mm.median, "{report}");
    }
}

#[test]
fn the_laws_follow_within_millimetres() {
    check("adaptive", PathSuite::Rigid, [1.2, 1.8, 2.6]);
    check("taut", PathSuite::Rigid, [1.3, 1.7, 3.6]);
    check("taut", PathSuite::Elastic, [1.3, 1.7, 3.6]);
}

/// Five rigs have at least one that has room for a circle.
#[test]
fn two_cables_follow_a_circle_in_a_picture_of_unknown_scale() {
    for report in quick("adaptive", PathSuite::Picture, 5) {
        assert!(report.runs > 2 && report.lost == 0, "{report} {:?}", report.losses);
        assert!(report.rms_mm.median <= 50.0 * report.speed_m_s && report.kept > 0.9, "{report}");
    }
}

#[test]
fn the_baselines_follow_with_feed_forward() {
    check("broyden", PathSuite::Rigid, [2.0, 3.0, 4.0]);
    check("model-5", PathSuite::Rigid, [1.2, 1.8, 3.0]);
}

#[test]
fn same_seed_gives_same_reports() {
    let run = || quick("sign", PathSuite::Rigid, 1);
    assert_eq!(run(), run());
}

#[test]
fn every_path_suite_is_parsed_from_its_name() {
    for suite in PathSuite::ALL {
        assert_eq!(suite.as_str().parse(), Ok(suite));
    }
    let unknown = "line".parse::<PathSuite>().unwrap_err();
    assert_eq!(unknown.to_string(), "one of path, path-elastic, path-picture");
}

#[test]
fn a_controller_that_cannot_follow_is_refused() {
    for kind in ControllerKind::all().iter().filter(|kind| !kind.can_go_on()) {
        let refused = follow_paths(kind, PathSuite::Rigid, 0..1, 1, &mut |_| ());
        assert!(matches!(refused, Err(BenchError::Unsuitable { .. })), "{kind}");
    }
}

/// The JSON is an interface for other programs.
#[test]
fn json_has_these_fields_and_no_others() {
    let report = quick("broyden", PathSuite::Rigid, 1).remove(0);
    let json: serde_json::Value = serde_json::to_value(&report).unwrap();
    let mut found: Vec<_> = json.as_object().unwrap().keys().map(String::as_str).collect();
    found.sort_unstable();
    let fields = [
        "cross_mm",
        "kept",
        "law",
        "lost",
        "p99_mm",
        "rigs",
        "rms_mm",
        "runs",
        "seed",
        "slack",
        "speed_m_s",
        "suite",
    ];
    assert_eq!(found, fields);
    assert!(json["rms_mm"]["median"].is_f64() && json["rms_mm"]["p90"].is_f64());
}
