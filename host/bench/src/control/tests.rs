mod fixed_point;

use plumb_emulator::plant::Task;
use plumb_runtime::rig::quantity::JacobianBound;
use plumb_runtime::rig::{LawName, LawSettings};
use plumb_sim::limits::RigLimits;

use super::*;

fn settings(gamma: f64) -> LawSettings {
    let mut law = LawSettings::from(LawName::Interval);
    law.set_gamma(gamma).unwrap();
    law
}

/// Returns the controller of that name.
fn controller(name: &str) -> ControllerKind {
    name.parse().unwrap()
}

/// Runs a suite of one target.
pub(super) fn run_one_target(
    controller: &ControllerKind,
    suite: &Suite,
    rigs: Range<u64>,
    seed: u64,
) -> Report {
    let mut reports = run(controller, suite, rigs, seed, &mut |_| ()).unwrap();
    assert_eq!(reports.len(), 1);
    reports.remove(0)
}

/// Runs the first `rigs` rigs of seed 11.
fn quick(controller: &ControllerKind, suite: SuiteName, rigs: u64) -> Report {
    run_one_target(controller, &Suite::new(suite), 0..rigs, 11)
}

/// docs/understand/method.md: median 2.15, all converge.
#[test]
fn interval_takes_twice_the_oracles_time() {
    let report = quick(&ControllerKind::Board(settings(450.0)), SuiteName::QuasiStatic, 40);
    assert_eq!(report.converged, 1.0, "{report}");
    assert!((1.8..2.5).contains(&report.median), "{report}");
}

/// docs/understand/method.md, on 60 rigs: all converge, with about the documented median times.
#[test]
fn laws_are_as_fast_as_documented() {
    for (law, suite, median) in [
        ("sign", SuiteName::QuasiStatic, 1.35),
        ("adaptive", SuiteName::QuasiStatic, 1.05),
        ("taut", SuiteName::Elastic, 1.35),
    ] {
        let report = quick(&controller(law), suite, 60);
        assert!(report.converged == 1.0 && report.median <= median, "{report}");
    }
}

/// The laws of two motors on the board: nearly all rigs converge, within 1.2 times the times that
/// were measured on 1000 rigs. That many are run with `PLUMB_LONG` set.
#[test]
fn two_motors_bring_the_ball_to_its_target() {
    let rigs = if std::env::var_os("PLUMB_LONG").is_some() { 1000 } else { 40 };
    for (law, mean, suite, [converged, median, p90]) in [
        ("interval", 0.0, SuiteName::Planar, [0.995, 1.97, 2.52]),
        ("sign", 0.0, SuiteName::Planar, [0.995, 1.29, 1.47]),
        ("adaptive", 0.0, SuiteName::Planar, [0.999, 1.21, 1.27]),
        ("adaptive", 0.2, SuiteName::Planar800, [0.995, 1.31, 1.51]),
        ("adaptive", 0.2, SuiteName::Planar150, [0.99, 1.33, 1.60]),
    ] {
        let mut controller = controller(law);
        let settings = controller.settings_mut().unwrap();
        settings.set_gamma(450.0).unwrap();
        settings.set_mean(mean.try_into().unwrap());
        let report = quick(&controller, suite, rigs);
        assert!(report.converged >= converged, "{report}");
        assert!(report.median <= median && report.p90 <= p90, "{report}");
    }
}

/// Returns the report of the law adaptive with a mean of 0.2 s on these first rigs of `suite`.
fn in_picture(suite: &Suite, rigs: u64) -> Report {
    let mut controller = controller("adaptive");
    controller.settings_mut().unwrap().set_mean(0.2.try_into().unwrap());
    run(&controller, suite, 0..rigs, 1, &mut |_| ()).unwrap().remove(0)
}

/// Two jogs and the law adaptive: the demands on 1000 rigs and cameras, which are run with
/// `PLUMB_LONG` set; a few rigs otherwise.
#[test]
fn two_jogs_bring_the_ball_to_a_pixel_wherever_the_camera_stands() {
    let rigs = if std::env::var_os("PLUMB_LONG").is_some() { 1000 } else { 25 };
    for stand in Stand::ALL {
        let suite = Suite { stand: Some(stand), ..Suite::new(SuiteName::Picture) };
        let report = in_picture(&suite, rigs);
        assert!(report.converged >= 0.998, "{stand}: {report}");
        assert!(report.median <= 1.25 && report.p90 <= 2.0 && report.p99 <= 3.5, "{report}");
        assert!(report.slack <= 0.015 && report.hold_mean_mm <= 0.2, "{stand}: {report}");
    }
    let jogs = jogs(&Suite::new(SuiteName::Picture), 0..rigs, 1, &mut |_| ()).unwrap();
    assert!(jogs.within_20_percent >= 0.98 && jogs.moved_p99_px <= 12.0, "{jogs}");
    assert!(jogs.latency_p90_ms <= 15.0, "{jogs}");
}

/// No run with a broken rig tells "reached" elsewhere, and most are stopped by name.
#[test]
fn a_rig_that_breaks_in_a_picture_is_stopped_by_name() {
    for defect in [Defect::Stuck, Defect::Caught, Defect::Reversed] {
        let suite = Suite { defect: Some(defect), ..Suite::new(SuiteName::Picture) };
        let report = in_picture(&suite, 20);
        let stopped: usize = report.faults.iter().map(|(_, count, _)| count).sum();
        assert!(stopped >= 16, "{defect}: {:?}", report.faults);
        assert_eq!(report.false_reached, 0.0, "{defect}: {report}");
    }
}

#[test]
fn two_motors_are_driven_to_one_target_by_a_law_that_knows_a_plane() {
    let planar = Suite::new(SuiteName::Planar);
    let refused = |name: &str, targets| {
        let suite = Suite { targets, ..planar.clone() };
        run(&controller(name), &suite, 0..1, 1, &mut |_| ()).unwrap_err()
    };
    for name in ["broyden", "model-5"] {
        let why = refused(name, 1).to_string();
        assert!(why.starts_with(&format!("{name} drives rigs with three motors")), "{why}");
    }
    assert!(matches!(refused("taut", 1), BenchError::Config(ConfigField::Law)));
    let why = refused("adaptive", 2).to_string();
    assert!(why.starts_with("adaptive has one target only"), "{why}");
    let oracle = quick(&ControllerKind::Oracle, SuiteName::Planar, 10);
    assert!(oracle.converged == 1.0 && oracle.max < 1.01, "{oracle}");
}

#[test]
fn same_seed_gives_same_report() {
    let controller = ControllerKind::Board(settings(450.0));
    assert_eq!(quick(&controller, SuiteName::Noise, 4), quick(&controller, SuiteName::Noise, 4));
}

/// 1.97 s on the paper's task.
#[test]
fn oracle_needs_59_frames_for_the_papers_task() {
    let time = oracle::time_s(&Task::paper(), &RigLimits::default(), 0.010).unwrap();
    assert!((time * 30.0 - 59.0).abs() < 1.0, "{time} s");
}

/// With full knowledge spring cables stay taut at little cost in time.
#[test]
fn reference_keeps_cables_taut() {
    let report = quick(&ControllerKind::Reference, SuiteName::Elastic, 40);
    assert!(report.converged == 1.0 && report.slack <= 0.05, "{report}");
    assert!(report.median < 1.15, "{report}");
}

/// A rigid rig that follows the oracle's plan needs the oracle's time on either clock.
#[test]
fn oracle_takes_its_own_time() {
    for clock in [Clock::Picture, Clock::Target] {
        let suite = Suite { clock, ..Suite::new(SuiteName::QuasiStatic) };
        let report = run_one_target(&ControllerKind::Oracle, &suite, 0..20, 11);
        assert!(report.median > 0.99 && report.max < 1.01, "{report}");
    }
}

/// docs/understand/method.md: the clock that starts 1 to 2 frames earlier shows 1 to 2 frames more.
#[test]
fn clock_from_target_adds_the_latency() {
    let suite = Suite { clock: Clock::Target, ..Suite::new(SuiteName::PaperTask) };
    let controller = controller("adaptive");
    let (early, late) = (
        run_one_target(&controller, &suite, 0..10, 11),
        quick(&controller, SuiteName::PaperTask, 10),
    );
    let frames = (early.median_s - late.median_s) * 30.0;
    assert!((0.9..=2.1).contains(&frames), "{frames} frames");
}

/// docs/understand/method.md: all baselines converge, with about the documented median times.
#[test]
fn baselines_converge() {
    for (name, median) in
        [("broyden", 1.2), ("model-5", 1.05), ("model-10", 1.06), ("model-20", 1.12)]
    {
        let report = quick(&controller(name), SuiteName::QuasiStatic, 60);
        assert!(report.converged == 1.0 && report.median <= median, "{report}");
    }
}

#[test]
fn every_controller_is_parsed_from_its_name() {
    for kind in ControllerKind::all() {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    let unknown = "taut-f64".parse::<ControllerKind>().unwrap_err();
    assert!(unknown.to_string().starts_with("one of interval, "), "{unknown}");
}

/// The JSON is an interface for other programs.
#[test]
fn json_has_these_fields_and_no_others() {
    let report = quick(&ControllerKind::Oracle, SuiteName::QuasiStatic, 2);
    let json: serde_json::Value = serde_json::to_value(&report).unwrap();
    let mut fields = [
        "law",
        "suite",
        "rigs",
        "seed",
        "converged",
        "median",
        "p90",
        "p99",
        "max",
        "target",
        "lost_s",
        "lost_p99_s",
        "told_s",
        "told_p99_s",
        "slack",
        "hold_mean_mm",
        "hold_p99_mm",
        "false_reached",
    ];
    fields.sort_unstable();
    let mut found: Vec<_> = json.as_object().unwrap().keys().map(String::as_str).collect();
    found.sort_unstable();
    assert_eq!(found, fields);
}

#[test]
fn every_suite_is_parsed_from_its_name_and_has_rigs() {
    let id = RunId { seed: 3, rig: 5 };
    for name in SuiteName::ALL {
        assert_eq!(name.as_str().parse(), Ok(name));
        let suite = Suite::new(name);
        suite.plant(&suite.task(id).unwrap(), id).unwrap();
    }
}

#[test]
fn refused_configurations_are_reported_before_any_run() {
    // α above β.
    let LawSettings::Interval { gamma, beta, signs, mean, .. } = settings(450.0) else {
        panic!("the settings are those of the law interval");
    };
    let law =
        LawSettings::Interval { gamma, alpha: JacobianBound::constant(7.0), beta, signs, mean };
    let suite = Suite::new(SuiteName::QuasiStatic);
    let refused = run(&ControllerKind::Board(law), &suite, 0..2, 1, &mut |_| ());
    assert!(matches!(refused, Err(BenchError::Config(ConfigField::Bounds))), "{refused:?}");
}

/// After half a second without positions at full speed, the variance of the filter's position
/// exceeds the range of its format.
#[test]
fn adaptive_survives_missing_positions_at_full_speed() {
    let (controller, suite) = (controller("adaptive"), Suite::new(SuiteName::QuasiStatic));
    for (seed, rig) in [(101, 70), (28, 393)] {
        let report = run_one_target(&controller, &suite, rig..rig + 1, seed);
        assert!(report.median < 1.5, "{report}");
    }
}

/// Noise of three times the expected size degrades the estimate of J while the ball is held. Steps
/// from that estimate without the certainty check move the ball away by 28 mm.
#[test]
fn adaptive_holds_its_ball_in_noise() {
    let (controller, suite) = (controller("adaptive"), Suite::new(SuiteName::Noise));
    let report = run_one_target(&controller, &suite, 211..212, 11);
    assert!(report.converged == 1.0 && report.hold_p99_mm < 5.0, "{report}");
}

/// With large pulleys and a ball 20 cm below the motors, the configured gain is ten times too
/// large.
#[test]
fn sign_reduces_a_gain_that_oscillates() {
    let (controller, suite) = (controller("sign"), Suite::new(SuiteName::QuasiStatic));
    for (seed, rig) in [(713, 19), (715, 670), (718, 391), (718, 556)] {
        let report = run_one_target(&controller, &suite, rig..rig + 1, seed);
        assert!(report.converged == 1.0, "{report}");
    }
}

/// The result of a rig does not depend on the range of rigs.
#[test]
fn a_rig_can_be_run_alone() {
    let (controller, suite) = (controller("sign"), Suite::new(SuiteName::QuasiStatic));
    let max = |rigs| run_one_target(&controller, &suite, rigs, 11).max;
    assert_eq!(max(5..7), max(5..6).max(max(6..7)));
}

/// A law that knows its rig after the first target loses less time to the later ones.
#[test]
fn each_further_target_has_a_report_and_is_reached_sooner() {
    let suite = Suite { targets: 3, ..Suite::new(SuiteName::Elastic800) };
    let reports = run(&controller("taut"), &suite, 0..40, 11, &mut |_| ()).unwrap();
    let [first, second, third] = &reports[..] else { panic!("{} reports", reports.len()) };
    assert_eq!([first, second, third].map(|report| report.target), [1, 2, 3]);
    let one = quick(&controller("taut"), SuiteName::Elastic800, 40);
    assert_eq!(&one, first);
    for report in &reports {
        assert_eq!((report.converged, report.false_reached), (1.0, 0.0), "{report}");
        assert!(report.lost_s > 0.0 && report.lost_s < report.lost_p99_s, "{report}");
        assert!((0.3..1.2).contains(&report.told_s), "{report}");
    }
    let lost = [second, third].map(|report| report.lost_s);
    assert!(lost.into_iter().all(|lost| lost < first.lost_s), "{first}\n{second}\n{third}");
}

/// A run on a rig that the board knows from the run before begins as a later target. On a changed
/// rig it is no slower than a cold start by more than noise.
#[test]
fn a_run_on_a_known_rig_is_quicker_than_a_cold_start() {
    let later = |name| {
        let suite = Suite { targets: 2, ..Suite::new(name) };
        let mut reports = run(&controller("taut"), &suite, 0..40, 11, &mut |_| ()).unwrap();
        for report in &reports {
            assert_eq!((report.converged, report.false_reached), (1.0, 0.0), "{report}");
        }
        [reports.remove(0), reports.remove(0)]
    };
    let [cold, warm] = later(SuiteName::Warm800);
    assert!(warm.lost_s < 0.9 * cold.lost_s, "{cold}\n{warm}");
    for name in [SuiteName::WarmMoved, SuiteName::WarmPulleys] {
        let [cold, changed] = later(name);
        assert!(changed.lost_s < 1.2 * cold.lost_s, "{cold}\n{changed}");
    }
}

#[test]
fn a_controller_without_a_law_of_the_board_keeps_nothing_for_a_next_run() {
    let suite = Suite::new(SuiteName::Warm800);
    let refused = run(&controller("broyden"), &suite, 0..1, 1, &mut |_| ()).unwrap_err();
    assert!(refused.to_string().starts_with("broyden keeps nothing"), "{refused}");
}

#[test]
fn a_controller_that_plays_a_plan_has_no_further_target() {
    let suite = Suite { targets: 2, ..Suite::new(SuiteName::QuasiStatic) };
    let refused = run(&ControllerKind::Oracle, &suite, 0..1, 1, &mut |_| ()).unwrap_err();
    assert!(refused.to_string().starts_with("oracle drives to one target only"), "{refused}");
}
