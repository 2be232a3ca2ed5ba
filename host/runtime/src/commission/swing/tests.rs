use super::*;

/// Random numbers from a seed.
struct Random(u64);

impl Random {
    fn uniform(&mut self, least: f64, greatest: f64) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        least + (greatest - least) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a normal number: the sum of twelve uniform ones.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform(0.0, 1.0)).sum::<f64>() - 6.0
    }
}

/// Ball, camera and link of a synthetic case.
#[derive(Debug, Clone, Copy)]
struct Scene {
    period: f64,
    damping: f64,
    /// Ball for a step, metres.
    step_m: f64,
    /// σ of the mode.
    gain: f64,
    /// Standard deviation of a place, metres.
    noise_m: f64,
    /// Correlation of the noise of a picture with that of the one before.
    correlation: f64,
    /// Share of pictures without a ball.
    lost: f64,
    /// Pictures a second.
    rate: f64,
}

const SCENE: Scene = Scene {
    period: 0.4,
    damping: 0.05,
    step_m: 0.0008,
    gain: 1.7,
    noise_m: 0.0012,
    correlation: 0.0,
    lost: 0.02,
    rate: 30.0,
};

/// Solution of the oscillator after a step of the acceleration of its anchor, exact: the distance
/// from the anchor, for an acceleration of 1.
fn after_step(scene: &Scene, since: f64) -> f64 {
    if since <= 0.0 || scene.period == 0.0 {
        return 0.0;
    }
    let omega = TAU / scene.period;
    let root = (1.0 - scene.damping * scene.damping).sqrt();
    let (sine, cosine) = (omega * root * since).sin_cos();
    let decay = (-scene.damping * omega * since).exp();
    -(1.0 - decay * (cosine + scene.damping / root * sine)) / (omega * omega)
}

/// Sample of the ball in steps of the motor, exact.
fn exact(scene: &Scene, drive: &Drive, time: f64) -> f64 {
    let place = |turn: &Turn| {
        let (acceleration, distance) = (drive.acceleration, turn.steps.abs());
        let highest = drive.rate.min((acceleration * distance).sqrt());
        let ramp = highest / acceleration;
        let flat = distance / highest;
        let edges = [(0.0, 1.0), (ramp, -1.0), (flat, -1.0), (flat + ramp, 1.0)];
        let of_edge = |(at, sign): (f64, f64)| {
            let since = (time - turn.begin - at).max(0.0);
            sign * acceleration * (since * since / 2.0 + after_step(scene, since))
        };
        turn.steps.signum() * edges.into_iter().map(of_edge).sum::<f64>()
    };
    drive.turns.iter().map(place).sum()
}

/// Watches the ball of `scene`, with noise, lag and lost pictures from `seed`.
fn watch(scene: &Scene, seed: u64) -> Watch {
    let mut random = Random(seed);
    let mut begin = 1.5;
    let turns = (0..20).map(|number| {
        let steps = if number % 2 == 0 { 6.0 } else { -6.0 };
        let turn = Turn { begin, steps };
        begin += 0.2 + random.uniform(0.0, 0.25);
        turn
    });
    let drive = Drive { turns: turns.collect(), rate: 50.0, acceleration: 2000.0 };
    let delay = random.uniform(-0.03, 0.05);
    let (mut at_rest, mut moved) = (Vec::new(), Vec::new());
    let mut error = 0.0;
    let pictures = ((begin + 1.0) * scene.rate) as u32;
    for picture in 0..pictures {
        let time = f64::from(picture) / scene.rate;
        let fresh = (1.0 - scene.correlation * scene.correlation).sqrt() * random.normal();
        error = scene.correlation * error + fresh;
        if random.uniform(0.0, 1.0) < scene.lost {
            continue;
        }
        let along = scene.step_m * exact(scene, &drive, time - delay) + scene.noise_m * error;
        let place = Sample { time, along: 0.3 + along };
        if time < 1.5 { at_rest.push(place) } else { moved.push(place) }
    }
    Watch { at_rest, moved, drive, gain: scene.gain }
}

/// Results of many seeds.
#[derive(Debug, Default)]
struct Count {
    stiff: u32,
    soft: u32,
    unknown: u32,
}

fn count(seeds: u64, scene: impl Fn(&mut Random) -> Scene) -> Count {
    let mut count = Count::default();
    for seed in 0..seeds {
        let scene = scene(&mut Random(!seed));
        match watch(&scene, seed).judge() {
            Measurement::Stiff { .. } => count.stiff += 1,
            Measurement::Soft { .. } => count.soft += 1,
            Measurement::Unknown(_) => count.unknown += 1,
        }
    }
    count
}

#[test]
fn the_curve_is_the_exact_solution() {
    for period in [0.0, 0.1, 0.3, 1.0] {
        let scene = Scene { period, ..SCENE };
        let drive = watch(&scene, 1).drive;
        let rates = drive.rates(1.4, 3000);
        let curve = Oscillator { period, damping: scene.damping }.curve(&rates);
        for tick in (0..3000).step_by(37) {
            let time = 1.4 + tick as f64 * TICK_S;
            let difference = curve[tick] - exact(&scene, &drive, time);
            assert!(difference.abs() < 0.25, "{period} s, {time}: {difference} steps");
        }
    }
}

#[test]
fn the_longest_safe_period_leaves_no_more_swing_than_shorter_ones() {
    let rest = |period: f64| {
        let phase = std::f64::consts::PI * STIFF_MEAN.get() / period;
        (phase.sin() / phase).abs()
    };
    let longest = Watch { gain: 9.0, ..watch(&SCENE, 1) }.longest_safe();
    let shorter = (1..=1000).map(|part| rest(STIFF_MEAN.get() * f64::from(part) / 1000.0));
    let side_lobe = shorter.fold(0.0, f64::max);
    assert!((longest - 0.3075).abs() < 1e-4, "{longest}");
    assert!((rest(longest) - side_lobe).abs() < 0.002, "{} {side_lobe}", rest(longest));
    assert!(rest(1.05 * longest) > side_lobe);
}

#[test]
fn a_swing_is_measured_to_a_tenth() {
    for (period, noise_m) in [(0.12, 0.0004), (0.4, 0.0012), (0.7, 0.0012)] {
        for seed in 0..20 {
            let scene = Scene { period, noise_m, ..SCENE };
            let measured = match watch(&scene, seed).judge() {
                Measurement::Stiff { period_s: Some(period) } if period < 0.2 => period,
                Measurement::Soft { period_s } => period_s,
                other => panic!("{period} s, seed {seed}: {other:?}"),
            };
            assert!((measured / period - 1.0).abs() < 0.1, "{period} s, {seed}: {measured}");
        }
    }
}

/// 120 seeds: swings of all periods that the span of stiff cables does not take out.
#[test]
fn a_slow_swing_is_never_taken_for_a_fast_one() {
    for correlation in [0.0, 0.9] {
        let count = count(120, |random| Scene {
            period: random.uniform(0.23, 1.1),
            damping: random.uniform(0.01, 0.15),
            step_m: random.uniform(0.0003, 0.0015),
            lost: random.uniform(0.0, 0.2),
            correlation,
            ..SCENE
        });
        assert_eq!(count.stiff, 0, "{count:?}");
        assert!(count.soft >= 60, "{count:?}");
    }
}

#[test]
fn cables_that_do_not_stretch_are_stiff_or_unknown() {
    let rigid = |noise_m| {
        count(60, |random| Scene {
            period: random.uniform(-0.1, 0.1).max(0.0),
            step_m: random.uniform(0.0005, 0.0015),
            noise_m,
            ..SCENE
        })
    };
    let clear = rigid(0.0004);
    assert!(clear.soft == 0 && clear.stiff >= 54, "{clear:?}");
    let noisy = rigid(0.002);
    assert!(noisy.soft == 0 && noisy.unknown >= 1, "{noisy:?}");
}

#[test]
fn a_swing_below_the_noise_is_unknown() {
    for period in [0.0, 0.15, 0.4] {
        let count = count(30, |_| Scene { period, step_m: 0.00004, ..SCENE });
        assert_eq!(count.unknown, 30, "{period} s: {count:?}");
    }
}

#[test]
fn few_pictures_and_other_motion_are_unknown() {
    let unknown = |watch: &Watch| match watch.judge() {
        Measurement::Unknown(doubt) => doubt,
        other => panic!("{other:?}"),
    };
    let good = watch(&SCENE, 3);
    assert!(matches!(good.judge(), Measurement::Soft { .. }), "{:?}", good.judge());
    let slow_camera = watch(&Scene { rate: 10.0, ..SCENE }, 3);
    assert_eq!(unknown(&slow_camera), Doubt::Pictures);
    assert_eq!(unknown(&Watch { moved: Vec::new(), ..good.clone() }), Doubt::Pictures);
    assert_eq!(
        unknown(&Watch { at_rest: good.at_rest[..10].into(), ..good.clone() }),
        Doubt::Pictures
    );
    let still = Watch { at_rest: vec![good.at_rest[0]; 45], ..good.clone() };
    assert_eq!(unknown(&still), Doubt::Pictures);
    let mut jumps = good;
    for place in jumps.moved.iter_mut().filter(|place| place.time > 4.0) {
        place.along += 0.01 * (7.0 * place.time).sin();
    }
    assert_eq!(unknown(&jumps), Doubt::Unexplained);
}
