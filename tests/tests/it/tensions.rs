//! The tensions that the law `taut` estimates, against those of elastic rigs.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use plumb_emulator::plant::Population;
use plumb_tests::tensions::{Agreement, Sample, TensionRun};

/// Time after which a drive has shown the rig's geometry, s.
const LEARNT_S: f64 = 4.0;

#[test]
fn the_estimated_tensions_follow_the_rigs() {
    let run = |seed| TensionRun { population: Population::default(), stiffness_n_m: 800.0, seed };
    let samples: Vec<Sample> = (0..20)
        .flat_map(|seed| run(seed).execute())
        .filter(|sample| sample.time_s >= LEARNT_S)
        .collect();
    assert_eq!(samples.len(), 20 * 3 * 240, "every rig has an estimate in every frame");
    let agreement = Agreement::of(&samples);
    assert!(agreement.correlation > 0.9, "{agreement:?}");
    assert!(agreement.median_error < 0.1, "{agreement:?}");
}
