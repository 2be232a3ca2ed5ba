//! A camera that is turned by 1 degree, and cameras that stand still.

use nalgebra::{Isometry3, Unit, Vector3};
use plumb_frame::source::BoxedError;
use plumb_vision::fuse::Side;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::case::{CASES, Case};
use super::report::KnockReport;
use super::stand::{Found, PERIOD_S, Stand};

/// Pictures of each camera before it is turned: 8 s.
const BEFORE: usize = 240;
/// Pictures of each camera in which it is to be found: 1 s.
const AFTER: usize = 30;
/// Frames of the other cases for one turned camera.
const FRAMES_OF_A_KNOCK: usize = 15;
/// Frames of cameras that stand still for one of the other cases: 2 h for 3000.
const QUIET_FACTOR: usize = 72;
/// Runs of cameras that stand still.
const QUIET_RUNS: usize = 12;
/// Least error that is to be found, millimetres.
const HARMFUL_MM: f64 = 20.0;

/// Runs both.
pub(super) fn run(seed: u64, frames: usize) -> Result<KnockReport, BoxedError> {
    let mut report = KnockReport::default();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for knock in 0..(frames / FRAMES_OF_A_KNOCK).max(1) {
        let case = CASES[knock % 3];
        let axis = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
        let side = Side::BOTH[knock / 3 % 2];
        let seed = seed.wrapping_mul(100_000).wrapping_add(knock as u64);
        turn(case, seed, (side, axis), &mut report)?;
    }
    let quiet = frames * QUIET_FACTOR / QUIET_RUNS;
    for run in 0..QUIET_RUNS {
        let share = (run as f64 + 0.5) / QUIET_RUNS as f64;
        let seed = seed.wrapping_mul(777_777).wrapping_add(run as u64);
        let mut stand = Stand::new(CASES[run % 3], seed, share)?;
        for _ in 0..quiet {
            stand.next(&mut |_| {})?;
        }
        report.quiet_hours += quiet as f64 * PERIOD_S / 3600.0;
        report.false_alarms += usize::from(stand.fuser.alarm().is_some());
    }
    Ok(report)
}

/// Turns a camera by 1 degree about an axis.
fn turn(
    case: Case,
    seed: u64,
    (side, axis): (Side, Vector3<f64>),
    report: &mut KnockReport,
) -> Result<(), BoxedError> {
    let mut stand = Stand::new(case, seed, (seed % 17) as f64 / 17.0)?;
    for _ in 0..BEFORE {
        stand.next(&mut |_| {})?;
    }
    report.false_alarms += usize::from(stand.fuser.alarm().is_some());
    let rotation = Isometry3::rotation(Unit::new_normalize(axis).into_inner() * 1f64.to_radians());
    stand.real[side as usize].pose *= rotation;
    let mut errors = Vec::new();
    for _ in 0..AFTER {
        let mut found = Vec::new();
        stand.next(&mut |it| found.push(it))?;
        for it in found {
            if let Found::Newest(stamp, position) = it {
                errors.push(1e3 * (position.mean - stand.truth(stamp)).norm());
            }
        }
    }
    let error = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    report.knocks += 1;
    let alarm = stand.fuser.alarm();
    if error > HARMFUL_MM {
        report.harmful += 1;
        report.told += usize::from(alarm.is_some());
        report.named += usize::from(alarm.is_some_and(|alarm| alarm.side == Some(side)));
        report.misnamed += usize::from(alarm.is_some_and(|it| it.side == Some(side.other())));
    }
    Ok(())
}
