use super::fixed_point::solve;
use super::*;

const PICTURE: Measurement = Measurement {
    ball: [0; 3],
    variances: [4_000_000, 1_000_000, 1_000_000],
    motors: [0; 3],
    motors_before: [[0; 3]; 2],
    motors_ahead: [0; 3],
    target: [0; 3],
    velocity: [0; 3],
};
/// Q6 µm/step: a small rig's, a usual one's and a large one's near its motors.
const JACOBIANS: [[[i32; 3]; 3]; 3] = [
    [[-2_000, -1_500, 5_000], [-5_000, 6_000, 100], [-2_500, -2_000, -3_000]],
    [[-17_000, -12_000, 30_000], [-35_000, 31_000, -900], [-18_000, -26_000, -14_000]],
    [[-50_000, -25_000, 90_000], [-80_000, 85_000, 0], [-60_000, -170_000, -200_000]],
];
const ERRORS: [[i32; 3]; 3] =
    [[-9_000, 4_000, -3_000], [150_000, -60_000, 390_000], [1_200_000, 900_000, -700_000]];

/// (J'J + `unknown`) n = J'e in floating point, by Cramer's rule.
fn exact(j: &[[i32; 3]; 3], unknown: [[f64; 3]; 3], e: [i32; 3]) -> [f64; 3] {
    let j = j.map(|row| row.map(|v| f64::from(v) / 64.0));
    let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
    let m = [0, 1, 2].map(|k| [0, 1, 2].map(|l| unknown[k][l] + sum(&|i| j[i][k] * j[i][l])));
    let b = [0, 1, 2].map(|k| sum(&|i| j[i][k] * f64::from(e[i])));
    let det = |m: &[[f64; 3]; 3]| {
        sum(&|c| {
            m[0][c]
                * (m[1][(c + 1) % 3] * m[2][(c + 2) % 3] - m[1][(c + 2) % 3] * m[2][(c + 1) % 3])
        })
    };
    [0, 1, 2].map(|c| {
        let mut swapped = m;
        (0..3).for_each(|k| swapped[k][c] = b[k]);
        det(&swapped) / det(&m)
    })
}

/// How far `n` (Q8) is off, of the longest.
fn off(n: [i32; 3], exact: [f64; 3]) -> f64 {
    let longest = exact.iter().fold(0.0, |most: f64, n| most.max(n.abs()));
    (0..3).map(|k| (f64::from(n[k]) / 256.0 - exact[k]).abs() / longest).fold(0.0, f64::max)
}

#[test]
fn a_cautious_step_is_the_one_of_its_equation() {
    let estimate = Estimate::new(&PICTURE, false, None);
    let unknown = [0, 1, 2].map(|k| {
        [0, 1, 2].map(|l| estimate.axes.iter().map(|a| f64::from(a.p_jj[k][l]) / 256.0).sum())
    });
    for (j, e) in JACOBIANS.iter().flat_map(|j| ERRORS.map(|e| (j, e))) {
        let off = estimate.cautious_steps(j, e).map(|n| off(n, exact(j, unknown, e)));
        assert!(off.is_some_and(|off| off < 0.01), "{j:?} {e:?}: {off:?}");
    }
}

#[test]
fn what_is_known_for_sure_is_used_as_it_is_and_is_certain() {
    let mut estimate = Estimate::new(&PICTURE, false, None);
    estimate.axes.iter_mut().for_each(|axis| axis.p_jj = [[0; 3]; 3]);
    for (j, e) in JACOBIANS.iter().flat_map(|j| ERRORS.map(|e| (j, e))) {
        let steps = estimate.steps(j, e).unwrap();
        assert_eq!(steps.unsure, 0);
        let off = solve(j, e).map(|newton| off(steps.n, newton.map(|n| f64::from(n) / 256.0)));
        assert!(off.is_some_and(|off| off < 0.05), "{:?} {off:?}", steps.n);
    }
}

/// Compares the doubt at the first measurement with its equation.
#[test]
fn doubt_is_that_of_its_equation() {
    let estimate = Estimate::new(&PICTURE, false, None);
    for (j, e) in JACOBIANS.iter().flat_map(|j| ERRORS.map(|e| (j, e))) {
        let n = estimate.cautious_steps(j, e).unwrap();
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let (e_, n_) = (e.map(f64::from), n.map(|n| f64::from(n) / 256.0));
        let p_jj = |i: usize, k: usize, l: usize| f64::from(estimate.axes[i].p_jj[k][l]) / 256.0;
        let variance = sum(&|i| e_[i] * e_[i] * sum(&|k| sum(&|l| n_[k] * p_jj(i, k, l) * n_[l])));
        let mean = sum(&|i| e_[i] * sum(&|k| f64::from(j[i][k]) / 64.0 * n_[k]));
        let exact = (variance.sqrt() / mean).min(1.0);
        let doubt = estimate.doubt(j, e, n).map(|doubt| f64::from(doubt) / 256.0);
        assert!(
            doubt.is_some_and(|doubt| (doubt - exact).abs() < 0.02),
            "{e:?}: {doubt:?} {exact}"
        );
        assert_eq!(estimate.doubt(j, e, n.map(|n| -n)), None);
    }
}

#[test]
fn steps_in_doubt_are_refused() {
    let mut estimate = Estimate::new(&PICTURE, false, None);
    let (j, e) = (estimate.projected(), [100_000, 50_000, -80_000]);
    assert!(estimate.steps(&j, e).is_none());
    estimate.axes.iter_mut().flat_map(|axis| &mut axis.p_jj).flatten().for_each(|p| *p /= 9);
    assert!(estimate.steps(&j, e).is_some_and(|steps| steps.unsure > 0));
}

/// A ball that jumps from one side of its target to the other; the first overshoot is free.
#[test]
fn each_overshoot_reduces_the_gain_until_the_target_changes() {
    let mut damping = OvershootDamping::new([0; 3]);
    let mut gain_scale = |k: i32, target| {
        damping.update([target, 0, 0], [if k % 2 == 0 { 20_000 } else { -20_000 }, 0, 0])
    };
    assert_eq!([0, 1].map(|k| gain_scale(k, 0)), [256; 2]);
    assert_eq!([2, 3, 3].map(|k| gain_scale(k, 0)), [192, 144, 144]);
    assert_eq!(gain_scale(4, 1), 256);
}

/// The noise of a ball at its target does not change J.
#[test]
fn j_is_estimated_on_the_way_and_not_at_the_target() {
    let after = |target: i32| {
        let measurement = Measurement { target: [target; 3], ..PICTURE };
        let mut estimate = Estimate::new(&measurement, false, None);
        for k in 1..10 {
            estimate.update(&Measurement {
                ball: [k % 3 * 1_000; 3],
                motors: [k % 2 * 16, 0, 0],
                ..measurement
            });
        }
        estimate.axes.map(|axis| axis.j)
    };
    assert_eq!(after(0), Estimate::new(&PICTURE, false, None).axes.map(|axis| axis.j));
    assert_ne!(after(100_000), after(0));
}
