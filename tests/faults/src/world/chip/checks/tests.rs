use plumb_protocol::units::{Micrometres, Point, Rate};

use super::*;

const READY: State = State::Ready;
const SEEKING: State = State::Seeking;

/// Telemetry of motors at rest at these positions, full steps.
fn telemetry(state: State, motors: [f64; 3]) -> Telemetry {
    Telemetry {
        time: Micros(0),
        state,
        configuration: Some(1),
        target: None,
        sequence: None,
        motors: motors.map(|steps| Steps16::from_si(steps).expect("a position")).into(),
        rates: [Rate(0); 3].into(),
        error: Point([Micrometres(0); 3]),
        filtered_error: Micrometres(0),
        bad_frames: 0,
        tensions: None,
        reference: None,
        late_ticks: 0,
    }
}

/// Checks of a run without faults, after a configuration.
fn configured() -> Checks {
    let mut plan = Plan::draw_short(0);
    plan.faults.clear();
    let mut checks = Checks::new(&plan, [0.0; 3]);
    checks.told(Micros(0), &telemetry(READY, [0.0; 3]));
    checks
}

/// Moves motor A by `rate(ms)` steps/s for `ticks` ms from `from` on, with a host that sends.
fn drive(checks: &mut Checks, from: u64, ticks: u64, state: State, rate: impl Fn(u64) -> f64) {
    let mut position = checks.last()[0];
    for tick in 1..=ticks {
        let now = Micros((from + tick) * 1000);
        position += rate(tick) / 1000.0;
        checks.heard(now);
        checks.moved(now, [position, 0.0, 0.0], state);
    }
}

fn assert_found(checks: &Checks, invariant: &str) {
    let found = checks.violations();
    assert!(found.len() == 1 && found[0].contains(invariant), "{found:?}");
}

/// A ramp within 2000 steps/s² up to 200 steps/s.
fn ramp(ms: u64) -> f64 {
    (2.0 * ms as f64).min(200.0)
}

#[test]
fn a_drive_within_the_limits_breaks_nothing() {
    let mut checks = configured();
    drive(&mut checks, 0, 500, SEEKING, ramp);
    assert_eq!(checks.violations(), [""; 0]);
}

#[test]
fn motion_without_a_configuration_is_found() {
    let mut checks = configured();
    checks.is_configured = false;
    drive(&mut checks, 0, 20, State::Unconfigured, ramp);
    assert_found(&checks, CONFIGURED);
}

#[test]
fn a_jump_of_the_rate_and_a_rate_above_the_limit_are_found() {
    let mut checks = configured();
    drive(&mut checks, 0, 100, SEEKING, |ms| if ms > 50 { 200.0 } else { 0.0 });
    assert_found(&checks, ACCELERATION);
    let mut checks = configured();
    drive(&mut checks, 0, 400, SEEKING, |ms| 2.0 * ms as f64);
    assert_found(&checks, RATE);
}

#[test]
fn motion_in_a_fault_and_without_a_host_is_found() {
    let mut checks = configured();
    drive(&mut checks, 0, 200, SEEKING, ramp);
    drive(&mut checks, 200, 2000, State::Fault(Fault::PositionLost), |_| 200.0);
    assert_found(&checks, FAULT);
    let mut checks = configured();
    drive(&mut checks, 0, 200, SEEKING, ramp);
    for tick in 1..2000 {
        let motors = [checks.last()[0] + 0.2, 0.0, 0.0];
        checks.moved(Micros(200_000 + tick * 1000), motors, SEEKING);
    }
    assert_found(&checks, SILENT);
}

#[test]
fn a_position_without_its_pulses_and_a_restart_are_found() {
    let mut checks = configured();
    checks.told(Micros(5000), &telemetry(READY, [1.0, 0.0, 0.0]));
    assert_found(&checks, POSITIONS);
    let mut checks = configured();
    checks.restarted(Micros(5000), [0.0; 3]);
    assert_found(&checks, RESTART);
}
