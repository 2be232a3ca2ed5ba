use super::*;

/// Rig whose ball moves by these pixels a step, seen late and with noise of a fixed sequence.
struct Linear {
    jacobian: Matrix2<f64>,
    turned: [f64; 2],
    time: f64,
    latency: f64,
    noise_px: f64,
    sees: bool,
    number: u32,
}

const PERIOD_S: f64 = 1.0 / 30.0;

impl Linear {
    fn new(jacobian: Matrix2<f64>) -> Self {
        let (turned, time, number) = ([0.0; 2], 0.0, 0);
        Self { jacobian, turned, time, latency: 0.06, noise_px: 0.2, sees: true, number }
    }

    /// Returns the place of the ball with the motors at `turned`.
    fn seen(&mut self, turned: [f64; 2]) -> Vector2<f64> {
        // A sequence with the variance of noise_px, whose mean over ten is 0.
        self.number += 1;
        let noise = |k: u32| (f64::from(k % 10) - 4.5) / 2.87 * self.noise_px;
        let noise = Vector2::new(noise(3 * self.number), noise(7 * self.number + 2));
        self.jacobian * Vector2::from(turned) + Vector2::new(300.0, 200.0) + noise
    }
}

impl TwoMotors for Linear {
    type Error = ();

    fn look(&mut self, pictures: usize) -> Result<Vec<Vector2<f64>>, ()> {
        self.time += PERIOD_S * pictures as f64;
        let seen = (0..pictures).map(|_| self.seen(self.turned));
        let seen: Vec<_> = seen.collect();
        Ok(if self.sees { seen } else { Vec::new() })
    }

    fn jog(&mut self, motor: usize, steps: f64) -> Result<Moving, ()> {
        let (begin, before) = (self.time, self.turned);
        let turn = |time: f64| (RATE * (time - begin)).clamp(0.0, steps.abs()) * steps.signum();
        let mut moving = Moving::default();
        let end = begin + steps.abs() / RATE + 0.4;
        while self.time < end {
            let mut turned = before;
            turned[motor] += turn(self.time - self.latency);
            let seen = self.seen(turned);
            moving.pictures.push((self.time, seen));
            moving.turned.push((self.time, turn(self.time)));
            self.time += PERIOD_S;
        }
        self.turned[motor] += steps;
        Ok(moving)
    }
}

#[test]
fn jogs_give_the_jacobian_and_the_latency_of_any_picture() {
    for scale in [0.05, 0.4, 3.0] {
        for columns in [[-0.7, 0.5, -0.7, -0.8], [0.7, 0.5, -0.7, 0.8], [0.1, 0.9, 0.9, 0.3]] {
            let [a, b, c, d] = columns.map(|it| it * scale);
            let mut rig = Linear::new(Matrix2::new(a, b, c, d));
            let measured = two_jogs(&mut rig).unwrap();
            let off = (measured.jacobian_px - rig.jacobian).amax() / rig.jacobian.amax();
            assert!(off < 0.1, "{scale} {columns:?}: {}", measured.jacobian_px);
            let late = measured.latency_s - rig.latency;
            assert!(late.abs() < 0.02, "{scale} {columns:?}: latency off by {late} s");
            let moved = rig.jacobian * Vector2::from(measured.steps);
            assert!(moved.norm() < 20.0, "{scale}: the ball moved by {moved}");
            assert_eq!(measured.steps, rig.turned);
        }
    }
}

/// Returns the refusal of a rig.
fn refusal(rig: &mut Linear) -> Refusal {
    match two_jogs(rig) {
        Err(JogsError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn rigs_that_the_motors_do_not_move_as_they_must_are_refused() {
    let mut dead = Linear::new(Matrix2::new(0.4, 0.0, 0.3, 0.0));
    assert!(matches!(refusal(&mut dead), Refusal::Still { motor: 'B', steps: 512.0, .. }));
    let mut flat = Linear::new(Matrix2::new(0.4, 0.5, 0.3, 0.3));
    assert!(matches!(refusal(&mut flat), Refusal::Alike { sine } if sine < 0.3));
    let mut swinging = Linear { noise_px: 3.0, ..Linear::new(Matrix2::identity()) };
    assert!(matches!(refusal(&mut swinging), Refusal::Unsteady { .. }));
    assert_eq!(swinging.turned, [0.0; 2], "a motor turned below a ball that swings");
    let mut blind = Linear { sees: false, ..Linear::new(Matrix2::identity()) };
    assert_eq!(refusal(&mut blind), Refusal::NotSeen { seen: 0, pictures: SWING_PICTURES });
    assert_eq!(blind.turned, [0.0; 2]);
}
