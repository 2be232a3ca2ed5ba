use nalgebra::Point3;
use plumb_emulator::plant::{Elastic, ElasticParameters, Plant, Task};
use plumb_protocol::AXES;
use plumb_runtime::rig::{LawName, LawSettings};

use super::*;
use crate::limits::RigLimits;

fn cosim(law: LawName) -> Cosim {
    let law = LawSettings::from(law);
    let mean = law.mean().config("mean").unwrap();
    let config = RigLimits::default().config(law.config(3).unwrap(), mean, 0.010);
    Cosim::new(Wiring::example(), config, None).unwrap()
}

fn request(t: f64, dt: f64) -> Request {
    Request { t, dt, position: None, age: 0.0, target: None, target_velocity: None }
}

/// The paper's task on springs, frames two frames late: an engine that is driven by the
/// answers alone.
#[test]
fn an_engine_that_follows_the_steps_reaches_the_target() {
    let task = Task::paper();
    let mut plant = Elastic::new(task.geometry, ElasticParameters::default(), task.start).unwrap();
    let mut cosim = cosim(LawName::Taut);
    let (dt, late) = (1.0 / 30.0, 2);
    let mut seen = vec![task.start; late];
    for frame in 0..300 {
        seen.push(plant.ball());
        let mut line = request(f64::from(frame) * dt, dt);
        line.position = Some(seen[seen.len() - 1 - late].into());
        line.age = dt * late as f64;
        line.target = (frame == 0).then_some(task.target.into());
        let answer = cosim.step(&line, 20).unwrap();
        for motors in &answer.steps {
            plant.advance(dt / 20.0, *motors).unwrap();
        }
        assert_eq!(answer.steps.len(), 20);
        if answer.reached {
            assert!((plant.ball() - task.target).norm() < 0.010);
            return;
        }
    }
    panic!("not there after 10 s: {}", plant.ball());
}

#[test]
fn long_spans_keep_the_link_alive_and_gaps_are_errors() {
    let mut cosim = cosim(LawName::Sign);
    let answer = cosim.step(&request(5.0, 3.0), 2).unwrap();
    assert_eq!((answer.t, answer.state.as_str(), answer.reached), (8.0, "ready", false));
    assert!(matches!(cosim.step(&request(9.0, 0.1), 1), Err(CosimError::Gap { .. })));
    assert!(matches!(cosim.step(&request(8.0, 0.0), 1), Err(CosimError::Number { key: "dt", .. })));
    for t in [1e10, -1e300, f64::NAN] {
        assert!(matches!(
            cosim.step(&request(t, 0.1), 1),
            Err(CosimError::Number { key: "t", .. })
        ));
    }
    let far = Request { target: Some([9.0, 0.0, 0.0]), ..request(8.0, 0.1) };
    assert_eq!(cosim.step(&far, 1), Err(CosimError::Refused(Refusal::TargetOutside)));
}

#[test]
fn a_board_with_a_lost_position_resumes_when_the_ball_returns() {
    let mut cosim = cosim(LawName::Adaptive);
    let line = |t, position| Request {
        position,
        target: (t == 0.0).then_some([0.4, 0.4, 0.15]),
        ..request(t, 0.1)
    };
    cosim.step(&line(0.0, Some([0.54, 0.22, 0.459])), 1).unwrap();
    let states: Vec<String> =
        (1..20).map(|k| cosim.step(&line(f64::from(k) * 0.1, None), 1).unwrap().state).collect();
    assert!(states.last().unwrap().starts_with("fault: no fresh position"), "{states:?}");
    let answer = cosim.step(&line(2.0, Some([0.54, 0.22, 0.459])), 1).unwrap();
    assert_eq!(answer.state, "seeking");
}

/// A target on a circle of 5 cm, at 5 cm/s, on springs, with frames that are two frames late.
#[test]
fn a_moving_target_is_followed_without_a_lag() {
    for (law, most) in [(LawName::Adaptive, 0.0015), (LawName::Taut, 0.0015)] {
        let task = Task::paper();
        let start = task.start;
        let mut plant = Elastic::new(task.geometry, ElasticParameters::default(), start).unwrap();
        let mut cosim = cosim(law);
        let (dt, late) = (1.0 / 30.0, 2);
        // The speed rises within a second.
        let circle = |t: f64| {
            let angle = if t < 1.0 { t * t / 2.0 } else { t - 0.5 };
            let (sin, cos) = angle.sin_cos();
            let place = [start.x + 0.05 * (cos - 1.0), start.y + 0.05 * sin, start.z];
            (place, [-sin, cos, 0.0].map(|v| 0.05 * t.min(1.0) * v))
        };
        let mut seen = vec![start; late];
        let (mut sum, mut count) = (0.0, 0);
        for frame in 0..300 {
            seen.push(plant.ball());
            let t = f64::from(frame) * dt;
            let (target, velocity) = circle(t);
            let request = Request {
                position: Some(seen[seen.len() - 1 - late].into()),
                age: dt * late as f64,
                target: Some(target),
                target_velocity: Some(velocity),
                ..request(t, dt)
            };
            if frame > 90 {
                sum += (plant.ball() - Point3::from(target)).norm_squared();
                count += 1;
            }
            let answer = cosim.step(&request, 20).unwrap();
            for motors in &answer.steps {
                plant.advance(dt / 20.0, *motors).unwrap();
            }
        }
        let rms = (sum / f64::from(count)).sqrt();
        assert!(rms < most, "{law}: {} mm", rms * 1e3);
    }
}

#[test]
fn a_velocity_needs_a_target_and_has_a_range() {
    let mut cosim = cosim(LawName::Adaptive);
    let alone = Request { target_velocity: Some([0.0; AXES]), ..request(0.0, 0.1) };
    assert_eq!(cosim.step(&alone, 1), Err(CosimError::VelocityAlone));
    let target = Some([0.5, 0.3, 0.2]);
    let fast = Request { target, target_velocity: Some([0.0, -2.1, 0.0]), ..request(0.0, 0.1) };
    assert!(matches!(cosim.step(&fast, 1), Err(CosimError::Number { key: "target_velocity", .. })));
    // Before the first picture the board does not know where the ball is.
    let early = Request { target, target_velocity: Some([0.1, 0.0, 0.0]), ..request(0.0, 0.1) };
    assert_eq!(cosim.step(&early, 1).unwrap().state, "ready");
}
