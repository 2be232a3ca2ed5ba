use super::*;

const BALL: Point3<f64> = Point3::new(0.4, 0.3, 0.2);

/// Returns all observations of `frames` frames of a ball at rest.
fn watch(parameters: CameraMonitorParameters, seed: u64, frames: u32) -> Vec<Observation> {
    let mut observer = CameraMonitor::new(parameters, seed).unwrap();
    for k in 0..frames {
        observer.observe(f64::from(k) * observer.period_s(), BALL);
    }
    std::iter::from_fn(|| observer.delivered(f64::INFINITY)).collect()
}

fn errors(seen: &[Observation]) -> Vec<Vector3<f64>> {
    seen.iter().filter_map(|o| Some(o.position? - BALL)).collect()
}

fn sd(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (values.map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

#[test]
fn a_perfect_observer_reports_the_position_at_once() {
    let mut observer = CameraMonitor::perfect(30.0).unwrap();
    assert_eq!(observer.delivered(10.0), None);
    observer.observe(0.1, BALL);
    assert_eq!(observer.delivered(0.099), None, "not before it was taken");
    assert_eq!(
        observer.delivered(0.1),
        Some(Observation { captured_at_s: 0.1, position: Some(BALL) })
    );
    assert_eq!(observer.delivered(10.0), None, "each frame once");
}

#[test]
fn latency_is_uniform_between_its_bounds_and_in_order() {
    let mut observer = CameraMonitor::new(CameraMonitorParameters::default(), 7).unwrap();
    let (period, ticks) = (observer.period_s(), 100);
    let mut latencies = Vec::new();
    let mut last = -1.0;
    for tick in 0..300_000 {
        let t = f64::from(tick) * period / f64::from(ticks);
        if tick % ticks == 0 {
            observer.observe(t, BALL);
        }
        while let Some(seen) = observer.delivered(t) {
            assert!(seen.captured_at_s > last, "out of order");
            last = seen.captured_at_s;
            latencies.push((t - seen.captured_at_s) / period);
        }
    }
    let (least, greatest) =
        latencies.iter().fold((9.0f64, 0.0f64), |(a, b), l| (a.min(*l), b.max(*l)));
    assert!(
        (0.999..1.02).contains(&least) && (1.99..2.02).contains(&greatest),
        "{least} to {greatest}"
    );
    let mean = latencies.iter().sum::<f64>() / latencies.len() as f64;
    assert!((mean - 1.5).abs() < 0.03, "{mean}");
    // With latencies of several frames, an observation arrives after those of earlier frames.
    let irregular = CameraMonitorParameters { latency_frames: (0.0, 5.0), ..Default::default() };
    let seen = watch(irregular, 7, 1000);
    assert!(seen.is_sorted_by(|a, b| a.captured_at_s < b.captured_at_s));
    assert_eq!(seen.len(), 1000);
}

#[test]
fn noise_has_its_standard_deviations() {
    let e = errors(&watch(CameraMonitorParameters::default(), 1, 20_000));
    for (axis, expected) in [2e-3, 1e-3, 1e-3].into_iter().enumerate() {
        let measured = sd(e.iter().map(|e| e[axis]));
        assert!((measured / expected - 1.0).abs() < 0.03, "axis {axis}: {measured}");
    }
}

#[test]
fn drift_is_correlated_from_frame_to_frame_and_on_the_depth_axis_only() {
    let drift = DepthDrift { sd_m: 3e-3, correlation: 0.9 };
    let e = errors(&watch(
        CameraMonitorParameters {
            depth_drift: Some(drift),
            ..CameraMonitorParameters::perfect(30.0)
        },
        1,
        50_000,
    ));
    let measured = sd(e.iter().map(|e| e.x));
    assert!((measured / 3e-3 - 1.0).abs() < 0.05, "{measured}");
    let product: f64 = e.windows(2).map(|w| w[0].x * w[1].x).sum::<f64>() / (e.len() as f64);
    assert!((product / (measured * measured) - 0.9).abs() < 0.02, "{product}");
    assert!(e.iter().all(|e| e.y.abs() < 1e-15 && e.z.abs() < 1e-15));
}

#[test]
fn frames_are_lost_singly_and_in_bursts() {
    let losses = |parameters| {
        let seen = watch(parameters, 3, 50_000);
        seen.iter().filter(|o| o.position.is_none()).count() as f64 / 50_000.0
    };
    let single = CameraMonitorParameters {
        dropout_probability: 0.02,
        ..CameraMonitorParameters::perfect(30.0)
    };
    assert!((losses(single) - 0.02).abs() < 0.003);
    let bursts = CameraMonitorParameters {
        burst_probability: 0.01,
        burst_frames: (4, 6),
        ..CameraMonitorParameters::perfect(30.0)
    };
    // One burst per 100 frames with a ball, with a mean length of 5.
    assert!((losses(bursts) - 5.0 / 104.0).abs() < 0.005, "{}", losses(bursts));
    let seen = watch(bursts, 3, 50_000);
    let mut runs = seen.chunk_by(|a, b| a.position.is_none() == b.position.is_none());
    assert!(runs.any(|run| run[0].position.is_none() && (4..=6).contains(&run.len())));
}

#[test]
fn outliers_have_their_probability_and_size() {
    let parameters = CameraMonitorParameters {
        outlier_probability: 0.05,
        outlier_size_m: 0.05,
        ..CameraMonitorParameters::perfect(30.0)
    };
    let e = errors(&watch(parameters, 5, 20_000));
    let far = e
        .iter()
        .filter(|e| e.norm() > 1e-9)
        .inspect(|e| assert!((e.norm() - 0.05).abs() < 1e-12))
        .count();
    assert!((800..1200).contains(&far), "{far} of 20 000");
}

#[test]
fn the_same_seed_gives_the_same_errors_and_streams_are_independent() {
    let base = watch(CameraMonitorParameters::default(), 11, 500);
    assert_eq!(base, watch(CameraMonitorParameters::default(), 11, 500));
    assert_ne!(base, watch(CameraMonitorParameters::default(), 12, 500));
    let later = CameraMonitorParameters {
        latency_frames: (3.0, 4.0),
        outlier_size_m: 1.0,
        ..Default::default()
    };
    assert_eq!(base, watch(later, 11, 500), "latency does not touch noise or losses");
}

#[test]
fn invalid_parameters_are_refused_by_name() {
    let good = CameraMonitorParameters::default();
    for (wrong, word) in [
        (CameraMonitorParameters { rate_hz: 0.0, ..good }, "rate"),
        (CameraMonitorParameters { latency_frames: (2.0, 1.0), ..good }, "latency"),
        (CameraMonitorParameters { noise_sd_m: [0.0, f64::NAN, 0.0], ..good }, "noise"),
        (CameraMonitorParameters { dropout_probability: 1.1, ..good }, "drop-out"),
        (CameraMonitorParameters { burst_frames: (5, 4), ..good }, "burst"),
        (
            CameraMonitorParameters {
                depth_drift: Some(DepthDrift { sd_m: 1e-3, correlation: 1.0 }),
                ..good
            },
            "correlation",
        ),
    ] {
        let message = CameraMonitor::new(wrong, 0).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}
