//! The field of two coils at the motor's positions.

use plumb_core::coils::Commutation;

fn commutation() -> Commutation {
    Commutation::new(core::array::from_fn(|i| {
        (4000.0 * (i as f64 * core::f64::consts::PI / 32.0).sin()).round() as u16
    }))
}

#[test]
fn microsteps_turn_the_field_evenly_at_one_strength() {
    for position in -200..200 {
        let [a, b] = commutation().at(position, 16).map(f64::from);
        let angle = f64::from(position) * core::f64::consts::PI / 32.0;
        assert!(
            (a - 4000.0 * angle.cos()).abs() <= 1.0 && (b - 4000.0 * angle.sin()).abs() <= 1.0,
            "{position}"
        );
    }
}

#[test]
fn full_steps_have_both_coils_on_and_change_one_at_a_time() {
    let steps: Vec<_> = (-8..8).map(|step| commutation().at(16 * step, 1)).collect();
    assert!(steps.iter().flatten().all(|drive| drive.abs() == 4000));
    for pair in steps.windows(2) {
        let changed = (0..2).filter(|&coil| pair[0][coil] != pair[1][coil]).count();
        assert_eq!(changed, 1);
    }
    assert_eq!(steps[0], steps[4], "four steps are a turn");
    assert_ne!(steps[0], steps[2]);
}

#[test]
fn every_other_half_step_has_one_coil_on() {
    let on = |position| commutation().at(position, 2).iter().filter(|&&drive| drive != 0).count();
    assert_eq!([0, 8, 16, 24].map(on), [1, 2, 1, 2]);
}

#[test]
fn the_field_turns_the_same_way_in_every_step_mode() {
    // From a position to the next, the field's cross product is positive.
    for microsteps in [1, 2, 4, 8, 16] {
        for k in -20..20 {
            let step = 16 / i32::from(microsteps);
            let [a, b] = [k, k + 1].map(|k| commutation().at(k * step, microsteps));
            assert!(a[0] * b[1] - a[1] * b[0] > 0, "{microsteps}: {a:?} {b:?}");
        }
    }
}
