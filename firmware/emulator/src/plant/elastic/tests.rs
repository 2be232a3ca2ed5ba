use plumb_protocol::{MOTORS, PerAxis};
use proptest::prelude::*;

use super::*;
use crate::plant::{PlanarPopulation, QuasiStatic, planar_rig, proptest_config};

const START: PerAxis<f64> = [0.54, 0.22, 0.459];

fn parameters(stiffness: f64, damping_ratio: f64) -> ElasticParameters {
    ElasticParameters { mass_kg: 0.2, stiffness_n_m: [stiffness; MOTORS], damping_ratio }
}

fn rig(stiffness: f64, damping_ratio: f64) -> Elastic {
    Elastic::new(Geometry::paper(), parameters(stiffness, damping_ratio), Point3::from(START))
        .unwrap()
}

fn energy(rig: &Elastic) -> f64 {
    potential(&rig.geometry, &rig.parameters, rig.lengths_m, &rig.position).energy
        + 0.5 * rig.parameters.mass_kg * rig.velocity.norm_squared()
}

#[test]
fn at_rest_it_stays_at_rest() {
    let mut rig = rig(800.0, 0.1);
    for _ in 0..100 {
        rig.advance(0.01, [0.0; MOTORS]).unwrap();
    }
    assert!((rig.ball() - Point3::from(START)).norm() < 1e-10, "{}", rig.ball());
    assert_eq!(rig.slack(), [false; MOTORS]);
    let per_weight = rig.geometry.tensions_per_weight(&rig.ball()).unwrap();
    for (tension, share) in rig.tensions_n().into_iter().zip(per_weight) {
        assert!((tension - share * 0.2 * GRAVITY_M_S2).abs() < 1e-7);
    }
}

#[test]
fn one_cable_sags_by_weight_over_stiffness() {
    let rig =
        Elastic::with_lengths(Geometry::paper(), parameters(150.0, 0.1), [2.0, 2.0, 0.5]).unwrap();
    let expected = Point3::new(0.0, 0.24, 0.665 - 0.5 - 0.2 * GRAVITY_M_S2 / 150.0);
    assert!((rig.ball() - expected).norm() < 1e-9, "{}", rig.ball());
    assert_eq!(rig.slack(), [true, true, false]);
}

#[test]
fn a_symmetric_rig_sags_as_computed_by_hand() {
    // Three motors on a circle of radius R: 3 k (r - l) h / r = m g with r² = R² + h². Choose r,
    // find l.
    let (radius, h, k) = (0.5, 0.4, 800.0);
    let at = |angle: f64| Point3::new(radius * angle.cos(), radius * angle.sin(), 1.0);
    let third = std::f64::consts::TAU / 3.0;
    let g = Geometry::new([at(0.0), at(third), at(2.0 * third)], [0.015; MOTORS]).unwrap();
    let r = f64::hypot(radius, h);
    let l = r - 0.2 * GRAVITY_M_S2 * r / (3.0 * k * h);
    let rig = Elastic::with_lengths(g, parameters(k, 0.1), [l; MOTORS]).unwrap();
    assert!((rig.ball() - Point3::new(0.0, 0.0, 1.0 - h)).norm() < 1e-9, "{}", rig.ball());
}

#[test]
fn without_taut_cables_it_falls_freely() {
    let mut rig = rig(800.0, 0.1);
    // The motors jump by a metre of cable, so that all cables are slack.
    rig.advance(0.0, [2200.0; MOTORS]).unwrap();
    assert_eq!(rig.slack(), [true; MOTORS]);
    for _ in 0..20 {
        rig.advance(0.01, [2200.0; MOTORS]).unwrap();
    }
    let fallen = Vector3::z() * (-0.5 * GRAVITY_M_S2 * 0.2 * 0.2);
    assert!((rig.ball() - Point3::from(START) - fallen).norm() < 1e-12, "{}", rig.ball());
    assert!((rig.velocity().z + GRAVITY_M_S2 * 0.2).abs() < 1e-12);
    assert_eq!(rig.slack(), [true; MOTORS]);
}

#[test]
fn it_bounces_at_the_frequency_of_mass_on_spring() {
    // Undamped on cable C alone after a jump of 1 mm of cable: z = z0 + 1 mm · (cos ωt - 1), with
    // ω² = k/m.
    let mut rig =
        Elastic::with_lengths(Geometry::paper(), parameters(800.0, 0.0), [2.0, 2.0, 0.5]).unwrap();
    let (start, omega) = (rig.ball().z, (800.0f64 / 0.2).sqrt());
    let steps = 1e-3 / rig.geometry.step_lengths_m()[2];
    rig.advance(0.0, [0.0, 0.0, steps]).unwrap();
    for k in 1..=1000 {
        rig.advance(0.002, [0.0, 0.0, steps]).unwrap();
        let t = f64::from(k) * 0.002;
        let expected = start + 1e-3 * ((omega * t).cos() - 1.0);
        assert!(
            (rig.ball().z - expected).abs() < 1e-5,
            "at {t} s: {} for {expected}",
            rig.ball().z
        );
    }
}

#[test]
fn damping_ratio_is_that_of_one_cable() {
    // Over whole periods of the damped frequency, the amplitude decays by exp(-ζωt).
    let mut rig =
        Elastic::with_lengths(Geometry::paper(), parameters(800.0, 0.1), [2.0, 2.0, 0.5]).unwrap();
    let (omega, rest) = ((800.0f64 / 0.2).sqrt(), rig.ball().z);
    rig.position.z += 1e-3;
    // A velocity that makes the motion purely exp(-ζωt) cos(ω_d t).
    rig.velocity.z = -0.1 * omega * 1e-3;
    let period = std::f64::consts::TAU / (omega * (1.0f64 - 0.01).sqrt());
    rig.advance(3.0 * period, [0.0; MOTORS]).unwrap();
    let expected = 1e-3 * (-0.1 * omega * 3.0 * period).exp();
    assert!(
        (rig.ball().z - rest - expected).abs() < 1e-8,
        "{} for {expected}",
        rig.ball().z - rest
    );
}

#[test]
fn energy_is_constant_without_damping_and_falls_with_it() {
    for (zeta, stiffness) in [(0.0, 800.0), (0.0, 150.0), (0.1, 800.0)] {
        let mut rig = rig(stiffness, zeta);
        rig.velocity = Vector3::new(0.05, -0.03, 0.1);
        let (before, bounce) = (energy(&rig), 0.5 * 0.2 * rig.velocity.norm_squared());
        let mut last = before;
        for _ in 0..1000 {
            rig.advance(0.01, [0.0; MOTORS]).unwrap();
            assert!(
                energy(&rig) < last + 1e-5 * bounce,
                "energy grows from {last} to {}",
                energy(&rig)
            );
            last = energy(&rig);
        }
        let lost = (before - last) / bounce;
        let expected = if zeta > 0.0 { 0.9..1.01 } else { -1e-4..1e-3 };
        assert!(
            expected.contains(&lost),
            "ζ = {zeta}, {stiffness} N/m: lost {lost} of the motion's energy"
        );
    }
}

/// Moves the motors fast, so that cables go slack and taut. Returns the rig, and whether a cable
/// went slack.
fn shake(mut rig: Elastic) -> (Elastic, bool) {
    let mut went_slack = false;
    for k in 0..200 {
        let t = f64::from(k) * 0.01;
        let steps = [40.0 * (18.0 * t).sin(), 60.0 * (14.0 * t).sin(), 50.0 * (10.0 * t).sin()];
        rig.advance(0.01, steps).unwrap();
        went_slack |= rig.slack().contains(&true);
    }
    (rig, went_slack)
}

#[test]
fn halving_the_substep_changes_little() {
    for (stiffness, tolerance_m) in [(150.0, 2e-5), (800.0, 5e-5)] {
        let (coarse, slack) = shake(rig(stiffness, 0.1));
        let mut finer = rig(stiffness, 0.1);
        finer.substep_s /= 2.0;
        let (finer, _) = shake(finer);
        let mut finest = rig(stiffness, 0.1);
        finest.substep_s /= 16.0;
        let (finest, _) = shake(finest);
        let error = |rig: &Elastic| (rig.ball() - finest.ball()).norm();
        assert!(slack, "no cable went slack at {stiffness} N/m");
        assert!(error(&coarse) < tolerance_m, "{} m at {stiffness} N/m", error(&coarse));
        assert!(
            error(&finer) < error(&coarse).max(1e-6),
            "{} then {}",
            error(&coarse),
            error(&finer)
        );
    }
}

#[test]
fn smooth_motion_converges_with_fourth_order() {
    let error = |division: f64| {
        let run = |division: f64| {
            let mut rig = rig(800.0, 0.1);
            rig.substep_s = 2e-3 / division;
            rig.velocity = Vector3::new(0.02, 0.01, 0.05);
            rig.advance(0.1, [2.0, 1.0, 0.5]).unwrap();
            assert_eq!(rig.slack(), [false; MOTORS]);
            rig.ball()
        };
        (run(division) - run(64.0)).norm()
    };
    let ratio = error(1.0) / error(2.0);
    assert!((10.0..25.0).contains(&ratio), "halving the sub-step divides the error by {ratio}");
}

#[test]
fn stiff_and_slow_is_quasi_static() {
    let g = Geometry::paper();
    let mut stiff = rig(1e6, 1.0);
    let mut rigid = QuasiStatic::new(g, Point3::from(START)).unwrap();
    for k in 1..=400 {
        // The ball moves down, then out of the triangle, where C goes slack. The motors start and
        // stop smoothly.
        let s = f64::from(k) / 400.0;
        let way = s * s * (3.0 - 2.0 * s);
        let steps = [20.0 * way, 100.0 * way, 1400.0 * way];
        stiff.advance(0.02, steps).unwrap();
        rigid.advance(0.02, steps).unwrap();
        let apart = (stiff.ball() - rigid.ball()).norm();
        assert!(rigid.slack()[2] || apart < 1e-4, "{apart} m apart at {s}");
        assert!(apart < 0.05, "{apart} m apart at {s} (a pendulum on two cables swings)");
    }
    assert!(rigid.slack()[2], "the path must end with a slack cable");
}

#[test]
fn stiff_cables_in_a_plane_hold_the_ball_as_rigid_ones() {
    let population = PlanarPopulation { height_m: 0.1, ..Default::default() };
    for index in 0..100 {
        let task = population.sample(5, index).unwrap();
        let mut stiff = Elastic::new(task.geometry, parameters(1e7, 0.1), task.start).unwrap();
        let mut rigid = QuasiStatic::new(task.geometry, task.start).unwrap();
        // Steps of both motors, then so many that A's cable is slack.
        for steps in [[50.0, -30.0, 900.0], [1e5, 0.0, 0.0]] {
            stiff.settle(steps).unwrap();
            rigid.settle(steps).unwrap();
            let apart = (stiff.ball() - rigid.ball()).norm();
            assert!(apart < 1e-5, "{apart} m apart in task {index}");
            assert_eq!(stiff.slack(), rigid.slack());
        }
        assert_eq!(stiff.slack(), [true, false, false]);
    }
}

#[test]
fn a_ball_at_rest_in_a_plane_stays_in_it() {
    let start = Point3::new(0.0, 0.3, 0.7);
    let mut rig = Elastic::new(planar_rig(), parameters(800.0, 0.1), start).unwrap();
    rig.advance(1.0, [0.0; MOTORS]).unwrap();
    assert!((rig.ball() - start).norm() < 1e-10, "{}", rig.ball());
    let (rig, went_slack) = shake(rig);
    assert!(went_slack && (rig.ball() - start).norm() > 1e-3, "{}", rig.ball());
    assert_eq!((rig.ball().x, rig.velocity().x), (0.0, 0.0));
    assert_eq!((rig.slack()[2], rig.tensions_n()[2]), (false, 0.0));
}

#[test]
fn out_of_the_plane_it_swings_as_a_pendulum() {
    // The pendulum's length is the depth below the line of two level motors.
    let motors = [1.0, 0.0].map(|y| Point3::new(0.0, y, 1.0));
    let geometry = Geometry::planar(motors, [0.015; 2]).unwrap();
    let start = Point3::new(0.0, 0.3, 0.6);
    let mut rig = Elastic::new(geometry, parameters(800.0, 0.1), start).unwrap();
    rig.position.x = 1e-3;
    let period = std::f64::consts::TAU * (0.4 / GRAVITY_M_S2).sqrt();
    for (quarters, expected) in [(1.0, 0.0), (2.0, -1e-3), (4.0, 1e-3)] {
        let mut rig = rig.clone();
        rig.advance(quarters / 4.0 * period, [0.0; MOTORS]).unwrap();
        assert!((rig.ball().x - expected).abs() < 1e-5, "{} for {expected}", rig.ball().x);
    }
}

#[test]
fn invalid_parameters_and_steps_are_refused() {
    let start = Point3::from(START);
    for wrong in [
        ElasticParameters { mass_kg: 0.0, ..Default::default() },
        ElasticParameters { mass_kg: f64::NAN, ..Default::default() },
        ElasticParameters { stiffness_n_m: [800.0, -1.0, 800.0], ..Default::default() },
        ElasticParameters { damping_ratio: -0.1, ..Default::default() },
    ] {
        let made = Elastic::new(Geometry::paper(), wrong, start);
        assert!(matches!(made, Err(RigError::OutOfRange { .. })), "{made:?}");
    }
    let soft = Elastic::new(Geometry::paper(), parameters(1.0, 0.1), start);
    assert!(matches!(soft, Err(RigError::NoCable { .. })), "{soft:?}");
    let mut rig = rig(800.0, 0.1);
    let before = rig.clone();
    for dt in [-0.1, f64::NAN, 1e9] {
        assert!(matches!(rig.advance(dt, [0.0; MOTORS]), Err(RigError::OutOfRange { .. })));
    }
    assert!(matches!(
        rig.advance(0.1, [-3000.0, 0.0, 0.0]),
        Err(RigError::NoCable { motor: 'A', .. })
    ));
    assert_eq!(rig, before);
}

proptest! {
    #![proptest_config(proptest_config())]

    /// Checks that the forces sum to zero at the equilibrium, for any slack cables.
    #[test]
    fn equilibrium_is_at_rest(
        lengths in prop::array::uniform3(0.3..2.0f64),
        stiffness in prop::array::uniform3(100.0..2000.0f64),
        mass_kg in 0.1..0.3f64,
    ) {
        let parameters =
            ElasticParameters { mass_kg, stiffness_n_m: stiffness, damping_ratio: 0.1 };
        for geometry in [Geometry::paper(), planar_rig()] {
            let rig = Elastic::with_lengths(geometry, parameters, lengths).unwrap();
            let still = [0.0; MOTORS];
            let (tensions, acceleration) = rig.pull(&rig.position, &rig.velocity, lengths, still);
            let (size, ball) = (acceleration.norm(), rig.position);
            prop_assert!(size < 1e-6, "{acceleration} at {ball} under {tensions:?}");
        }
    }
}
