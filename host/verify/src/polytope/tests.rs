use plumb_core::BuildLimits;
use plumb_core::law::{Interval as FixedPoint, V_FRACTION_BITS};
use plumb_core::params::Params;
use plumb_protocol::config::{
    self, Config, Deadlines, Drivers, Growth, Motor, Reached, StepDir, Workspace,
};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Point, Rate, Steps16,
};
use proptest::prelude::*;

use super::*;
use crate::Family;

/// A family as the board is told it: any signs, any bounds α_ik <= β_ik up to 8.
fn told() -> impl Strategy<Value = config::Interval> {
    let signs = proptest::array::uniform9(-1i8..=1);
    let bounds = proptest::array::uniform9((1u32..1 << 18, 0u32..1 << 18));
    (signs, bounds).prop_map(|(signs, bounds)| {
        let at =
            |f: &dyn Fn(usize) -> u32| [0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| Bound(f(n))));
        let mut signs = [0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| signs[n]));
        // Every motor moves something.
        let idle: Vec<_> = (0..3).filter(|&k| signs.iter().all(|row| row[k] == 0)).collect();
        idle.into_iter().for_each(|k| signs[k][k] = -1);
        let (alpha, beta) = (at(&|n| bounds[n].0), at(&|n| bounds[n].0 + bounds[n].1));
        config::Interval { signs, alpha, beta, gain: Gain(1 << 16) }
    })
}

/// The law on the chip.
fn fixed_point(family: config::Interval) -> FixedPoint {
    let build = BuildLimits { max_pulse_rate: 1_000_000, storage: true };
    Params::check(&config(family), &build).unwrap().interval().unwrap()
}

/// A configuration that a board accepts. Only its law matters here.
fn config(family: config::Interval) -> Config {
    let motor = Motor {
        max_rate: Rate::from_si(400.0).unwrap(),
        max_acceleration: Acceleration(2000),
        travel_min: Steps16(-64_000),
        travel_max: Steps16(64_000),
        reversed: false,
    };
    Config {
        law: config::Law::Interval(family),
        motors: [motor; 3],
        microsteps: 16,
        workspace: Workspace {
            min: Point::from_metres([-1.0, -1.0, -1.0]).unwrap(),
            max: Point::from_metres([2.0, 2.0, 0.6]).unwrap(),
        },
        reached: Reached { radius: Micrometres(10_000), frames: 10 },
        deadlines: Deadlines {
            host: Milliseconds(300),
            position: Milliseconds(500),
            max_age: Milliseconds(250),
        },
        growth: Growth { margin: Micrometres(60_000), time: Milliseconds(600) },
        drivers: Drivers::StepDir(StepDir::TMC2209),
        mean: Milliseconds(0),
    }
}

/// The same family for this module.
fn family(told: &config::Interval) -> Family {
    let entry = |i: usize, k: usize| {
        let (a, b) = (told.alpha[i][k].to_si(), told.beta[i][k].to_si());
        match told.signs[i][k] {
            0 => Interval::point(0.0),
            1 => Interval::new(a, b),
            _ => Interval::new(-b, -a),
        }
    };
    Family([0, 1, 2].map(|i| [0, 1, 2].map(|k| entry(i, k))))
}

/// The signs (12) and some entries that may have any sign, so that v is often 0.
fn any_family() -> impl Strategy<Value = Family> {
    proptest::array::uniform9((-1.0f64..1.0, 0.0f64..1.0)).prop_map(|entries| {
        Family([0, 3, 6].map(|r| {
            [r, r + 1, r + 2].map(|n| Interval::new(entries[n].0, entries[n].0 + entries[n].1))
        }))
    })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = [0, 1, 2].map(|k| a[k] - b[k]);
    inner(d, d).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// The explicit formula is the minimum-norm problem over the family's corners. The tolerance is
    /// what the solution's own duality gap proves of it, |v - v(e)|² <= gap; the solver is asked
    /// for a gap of 1e-12 where |M'e| is about 1.
    #[test]
    fn the_explicit_formula_solves_the_problem(family in any_family(), e in proptest::array::uniform3(-1.0f64..1.0)) {
        let found = Polytope::new(family.vertices()).unwrap().minimum_norm(e).unwrap();
        prop_assert!(found.error < 1e-5, "{found:?}");
        prop_assert!(distance(found.v, family.v(e)) <= found.error + 1e-12, "{found:?}, {:?}", family.v(e));
    }

    /// The chip's v is rounded towards zero to a 256th of a micrometre in each of its three parts.
    #[test]
    fn the_law_on_the_chip_solves_it(told in told(), e in proptest::array::uniform3(-20_000i32..20_000)) {
        let found = Polytope::new(family(&told).vertices()).unwrap().minimum_norm(e.map(f64::from)).unwrap();
        // Micrometres, of which M'e has up to 480 000: v saturates at 524 288 on the chip.
        prop_assert!(found.error < 5.0, "{found:?}");
        let unit = 1.0 / f64::from(1u32 << V_FRACTION_BITS);
        let chip = fixed_point(told).v(e).map(|v| f64::from(v) * unit);
        prop_assert!(distance(found.v, chip) <= found.error + 2.0 * unit, "{chip:?} for {found:?}");
    }

    /// e'Mv >= |v|² for every M of a polytope.
    #[test]
    fn e_falls_for_every_member(
        vertices in proptest::collection::vec(proptest::array::uniform3(proptest::array::uniform3(-1.0f64..1.0)), 1..12),
        e in proptest::array::uniform3(-1.0f64..1.0),
    ) {
        let polytope = Polytope::new(vertices.clone()).unwrap();
        let v = polytope.minimum_norm(e).unwrap().v;
        for m in &vertices {
            prop_assert!(inner(transposed_times(m, e), v) >= inner(v, v) - 1e-10);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// What the bisection says is what vertex determinants say, where those decide: for interval
    /// families.
    #[test]
    fn both_ways_to_nonsingularity_agree(
        centre in proptest::array::uniform9(-1.0f64..1.0), width in 0.0f64..0.3,
    ) {
        let family = Family([0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| {
            // Four entries have a width: 16 corners.
            Interval::new(centre[n], centre[n] + if n % 2 == 0 && n != 4 { width } else { 0.0 })
        })));
        let found = Polytope::new(family.vertices()).unwrap().robustness(3000);
        match found.verdict {
            Verdict::Nonsingular => prop_assert!(family.nonsingular()),
            Verdict::Singular => prop_assert!(!family.nonsingular()),
            Verdict::Open => prop_assert!(found.least_v.lo == 0.0),
        }
        if found.verdict == Verdict::Nonsingular {
            let explicit = family.least_v();
            prop_assert!(found.least_v.lo <= explicit.hi && explicit.lo <= found.least_v.hi, "{found:?} {explicit:?}");
        }
    }
}

fn diagonal(x: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

#[test]
fn a_matrix_alone_has_its_least_singular_value() {
    let found = Polytope::new(vec![diagonal(3.0, 0.5, -2.0)]).unwrap().robustness(10_000);
    assert_eq!(found.verdict, Verdict::Nonsingular);
    assert!(
        found.least_v.lo <= 0.5 && 0.5 <= found.least_v.hi && found.least_v.width() < 0.03,
        "{found:?}"
    );
    assert!(found.direction[1].abs() > 0.95, "{found:?}");
}

/// All vertices have determinant 1, and half the sum of the first two is singular: what vertices
/// alone don't show.
#[test]
fn a_singular_matrix_inside_is_found() {
    let vertices = vec![
        diagonal(1.0, 1.0, 1.0),
        diagonal(-1.0, -1.0, 1.0),
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    ];
    let two = Polytope::new(vertices[..2].to_vec()).unwrap().robustness(10_000);
    assert_ne!(two.verdict, Verdict::Nonsingular, "{two:?}");
    let mut inside = vertices.clone();
    inside.push([[0.5, 1.0, 0.0], [1.0, 2.5, 0.0], [0.0, 0.0, 1.0]]);
    let found = Polytope::new(inside).unwrap().robustness(10_000);
    assert_eq!(found.verdict, Verdict::Singular, "{found:?}");
}

#[test]
fn what_is_no_family_is_named() {
    assert!(matches!(Polytope::new(vec![]), Err(PolytopeError::Empty)));
    let nan = Polytope::new(vec![diagonal(1.0, 1.0, 1.0), diagonal(1.0, f64::NAN, 1.0)]);
    assert!(matches!(nan, Err(PolytopeError::Entry { vertex: 2, .. })), "{nan:?}");
    let none = Polytope::new(vec![diagonal(0.0, 0.0, 0.0)]).unwrap();
    assert_eq!(none.minimum_norm([1.0, 2.0, 3.0]).unwrap().v, [0.0; 3]);
    assert_eq!(none.robustness(100).verdict, Verdict::Open);
}
