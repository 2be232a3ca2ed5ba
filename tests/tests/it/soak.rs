//! Half an hour of virtual time on one board; `make soak` drives a hundred hours.

use plumb_tests::soak::Soak;

#[test]
fn half_an_hour_of_sessions_with_failures_breaks_nothing_and_repeats() {
    let mut soak = Soak::new(7);
    let report = soak.run_until(0.5).clone();
    assert_eq!(report.violations, [] as [String; 0], "{report:#?}");
    let kinds: Vec<&str> = report.causes.keys().map(|(disturbance, _)| *disturbance).collect();
    assert!(kinds.contains(&"none") && report.causes.len() > 3, "{report:#?}");
    assert!(report.reached > 50, "{report:#?}");
    assert_eq!(*Soak::new(7).run_until(0.5), report);
}
