//! `plumb check` on cables that stretch more or less: the swing of the ball tells soft cables from
//! stiff ones, and no soft one is taken for stiff. With a camera's noise, lag and lost pictures.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use nalgebra::Matrix3;
use plumb_emulator::plant::{ElasticParameters, Population};
use plumb_runtime::commission::{COMMON_GAIN, Measurement};
use plumb_tests::commissioning::{Case, examine};
use plumb_tests::parallel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Seed of the rigs: another than that on which the measurement was tuned, except for
/// [`COMMON_GAIN`], which is the quantile of this one.
const SEED: u64 = 58;

/// Stiffness of soft cables, N/m.
const SOFT_N_M: f64 = 150.0;

/// Stiffness of stiff cables that stretch, N/m.
const STIFF_N_M: f64 = 800.0;

/// Longest period for which the span of stiff cables is safe, seconds.
const LONGEST_SAFE_S: f64 = 0.307;

/// Results of many rigs.
#[derive(Debug, Default)]
struct Count {
    stiff: Vec<u64>,
    /// With the measured periods, seconds.
    soft: Vec<(u64, f64)>,
    unknown: Vec<u64>,
    /// Rigs that the steps before accuse of a fault, or whose check ended early.
    failed: Vec<String>,
}

/// Examines `rigs` rigs without a fault, whose ball and cables are those of `cables`.
fn count(rigs: u64, cables: impl Fn(&Case, f64) -> Option<ElasticParameters> + Sync) -> Count {
    let examined = parallel::map(0..rigs, parallel::processors(), |index| {
        let mut random = ChaCha8Rng::seed_from_u64(SEED ^ !index);
        let case = Case::right(SEED, index);
        let elastic = cables(&case, random.random_range(0.1..0.3));
        (index, examine(&case.with_cables(elastic)))
    });
    let mut count = Count::default();
    for (index, examined) in examined {
        match examined.map(|report| (report.is_right(), report)) {
            Ok((true, report)) => match report.stiffness {
                Measurement::Stiff { .. } => count.stiff.push(index),
                Measurement::Soft { period_s } => count.soft.push((index, period_s)),
                Measurement::Unknown(_) => count.unknown.push(index),
            },
            Ok((false, report)) => count.failed.push(format!("rig {index}: {:?}", report.faults)),
            Err(error) => count.failed.push(format!("rig {index}: {error}")),
        }
    }
    count
}

/// Every other rig has cables whose stiffness falls with their length, the stiffest of 150 N/m.
#[test]
fn soft_cables_are_never_taken_for_stiff_ones() {
    let count = count(120, |case, mass_kg| {
        let lengths = case.lengths_m();
        let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
        let stiffness_n_m = match case.seed % 2 {
            0 => [SOFT_N_M; 3],
            _ => lengths.map(|length| SOFT_N_M * shortest / length),
        };
        Some(ElasticParameters { mass_kg, stiffness_n_m, ..ElasticParameters::default() })
    });
    assert_eq!((&count.stiff, &count.failed), (&Vec::new(), &Vec::new()), "{count:?}");
    assert!(count.soft.len() >= 60, "{count:?}");
}

/// Steep cables let the ball swing slowly, however stiff they are: this counts as soft.
#[test]
fn stiff_and_rigid_cables_are_never_taken_for_soft_ones() {
    let mut stiff = count(60, |_, _| {
        let stiffness_n_m = [STIFF_N_M; 3];
        Some(ElasticParameters { mass_kg: 0.2, stiffness_n_m, ..ElasticParameters::default() })
    });
    let is_fast = |&(index, _): &(u64, f64)| {
        Case::right(SEED, index).slowest_period_s(0.2, STIFF_N_M) < LONGEST_SAFE_S
    };
    stiff.soft.retain(is_fast);
    let rigid = count(60, |_, _| None);
    for (count, least) in [(stiff, 10), (rigid, 15)] {
        assert_eq!((&count.soft, &count.failed), (&Vec::new(), &Vec::new()), "{count:?}");
        assert!(count.stiff.len() >= least, "{count:?}");
    }
}

/// σ: largest singular value of the inverse of the cables' unit vectors.
#[test]
fn nine_places_of_ten_have_at_most_the_common_gain() {
    let population = Population::default();
    let mut gains: Vec<f64> = (0..2000)
        .map(|index| {
            let task = population.sample(SEED, index).expect("a rig of the population");
            let cables = task.geometry.motors().map(|motor| (task.start - motor).normalize());
            let squares = Matrix3::from_columns(&cables).singular_values();
            1.0 / squares.min()
        })
        .collect();
    gains.sort_by(f64::total_cmp);
    let at_nine_of_ten = gains[1800];
    assert!((0.95 * COMMON_GAIN..=COMMON_GAIN).contains(&at_nine_of_ten), "{at_nine_of_ten}");
}
