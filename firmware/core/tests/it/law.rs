//! The interval law in fixed point against the paper's equations in f64.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use crate::common::{self, interval_config, params};
use plumb_core::MotorRates;
use plumb_core::law::{Interval, V_FRACTION_BITS};
use plumb_protocol::config;
use plumb_protocol::units::{Bound, Gain};
use proptest::prelude::*;

/// Returns v of eqs. (7), (8) in f64. Every product of whole micrometres and Q16 bounds is exact
/// there.
fn v_f64(law: &config::Interval, e: [i32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let ends = [0, 1, 2].map(|i| {
            let sign = f64::from(law.signs[i][k]);
            let (a, b) = (
                law.alpha[i][k].to_si() * sign * f64::from(e[i]),
                law.beta[i][k].to_si() * sign * f64::from(e[i]),
            );
            (a.min(b), a.max(b))
        });
        let (eta, mu): (f64, f64) =
            (ends.iter().map(|p| p.0).sum(), ends.iter().map(|p| p.1).sum());
        if eta > 0.0 {
            eta
        } else if mu < 0.0 {
            mu
        } else {
            0.0
        }
    })
}

/// Returns any sign pattern in which every motor moves the ball, with any bounds α_ik <= β_ik.
fn families() -> impl Strategy<Value = config::Interval> {
    let signs = any::<[[bool; 3]; 3]>();
    let zeros = proptest::array::uniform3(0usize..4);
    let bounds = proptest::array::uniform9((1u32..1 << 19, 0u32..1 << 19));
    (signs, zeros, bounds, 1u32..=16 << 16).prop_map(|(signs, zeros, bounds, gain)| {
        config::Interval {
            signs: [0, 1, 2].map(|i| {
                let row = [0, 1, 2].map(|k| {
                    if zeros[k] == i {
                        0
                    } else if signs[i][k] {
                        1
                    } else {
                        -1
                    }
                });
                row.into()
            }),
            alpha: [0, 1, 2].map(|i| [0, 1, 2].map(|k| Bound(bounds[3 * i + k].0)).into()),
            beta: [0, 1, 2].map(|i| {
                [0, 1, 2]
                    .map(|k| Bound((bounds[3 * i + k].0 + bounds[3 * i + k].1).min(8 << 16)))
                    .into()
            }),
            gain: Gain(gain),
        }
    })
}

/// Returns a Jacobian of the family: each entry at a fraction of its interval.
fn member(law: &config::Interval, at: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|k| {
            let (alpha, beta) = (law.alpha[i][k].to_si(), law.beta[i][k].to_si());
            f64::from(law.signs[i][k]) * (alpha + at[i][k] * (beta - alpha))
        })
    })
}

fn law(family: config::Interval) -> Interval {
    params(interval_config(family)).interval().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_same_motors_are_active_and_v_is_within_one_unit(
        family in families(), e in proptest::array::uniform3(-8_000_000i32..8_000_000)
    ) {
        let (fixed, float) = (law(family).v(e), v_f64(&family, e));
        for k in 0..3 {
            let unit = 1.0 / f64::from(1u32 << V_FRACTION_BITS);
            let exact = float[k].clamp(-524_288.0, 524_288.0);
            let got = f64::from(fixed[k]) * unit;
            // v is rounded towards zero: not above the exact value, and less than a unit below it.
            let below = exact.abs() - got.abs();
            prop_assert!((0.0..unit).contains(&below), "{got} for {exact}");
            prop_assert!(got == 0.0 || got.signum() == exact.signum());
        }
    }

    /// The min-max theorem: e'Jv >= |v|² for every J of the family, so |e| falls.
    #[test]
    fn e_falls_for_every_jacobian_of_the_family(
        family in families(),
        at in proptest::array::uniform3(proptest::array::uniform3(0.0f64..=1.0)),
        e in proptest::array::uniform3(-1_000_000i32..1_000_000),
    ) {
        let v = law(family).v(e).map(|v| f64::from(v) / f64::from(1u32 << V_FRACTION_BITS));
        let j = member(&family, at);
        let moved = j.map(|row| (0..3).map(|k| row[k] * v[k]).sum::<f64>());
        let descent: f64 = (0..3).map(|i| f64::from(e[i]) * moved[i]).sum();
        let square: f64 = v.iter().map(|v| v * v).sum();
        prop_assert!(descent >= square * (1.0 - 1e-9), "{descent} < {square}");
    }

    #[test]
    fn rates_are_v_times_the_gain_against_its_sign(
        family in families(), e in proptest::array::uniform3(-1_000_000i32..1_000_000)
    ) {
        let law = law(family);
        let (v, rates) = (law.v(e), law.rates(e).0);
        for k in 0..3 {
            let exact = -f64::from(v[k]) * family.gain.to_si();
            prop_assert!((f64::from(rates[k]) - exact).abs() <= 1.0);
        }
    }

    #[test]
    fn one_factor_brings_rates_within_their_limits(
        rates in any::<[i32; 3]>(), limits in proptest::array::uniform3(1i32..1 << 28)
    ) {
        let limited = MotorRates(rates).within(limits).0;
        for k in 0..3 {
            prop_assert!(limited[k].abs() <= limits[k]);
        }
        let factor = (0..3)
            .map(|k| f64::from(limits[k]) / f64::from(rates[k]).abs())
            .fold(1.0, f64::min);
        for k in 0..3 {
            let exact = factor * f64::from(rates[k]);
            prop_assert!((f64::from(limited[k]) - exact).abs() <= 1.0 + 1e-6);
        }
    }
}

#[test]
fn one_motor_moves_for_most_errors_at_the_papers_bounds() {
    // β/α = 100: 97.5 % of the directions of e (docs/understand/interval.md), over a grid of the
    // sphere.
    let law = law(common::paper_interval(30.0));
    let (mut one, mut all) = (0, 0);
    for i in 1..200 {
        for j in 0..400 {
            let (z, turn) =
                (f64::from(i) / 100.0 - 1.0, f64::from(j) * std::f64::consts::TAU / 400.0);
            let r = (1.0 - z * z).sqrt();
            let e = [r * turn.cos(), r * turn.sin(), z].map(|c| (c * 1e6) as i32);
            let active = law.v(e).iter().filter(|v| **v != 0).count();
            one += usize::from(active == 1);
            all += 1;
        }
    }
    let share = one as f64 / all as f64;
    assert!((share - 0.975).abs() < 0.01, "{share}");
}
