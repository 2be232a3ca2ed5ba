//! The live camera: pairs, options, lost pictures and silence.

use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_realsense::sys::RawIntrinsics;
use plumb_realsense::{Camera, DeviceInfo, Mode, Pair, RealsenseError, Sensor, Settings, Target};
use plumb_realsense_device::{Control, Fault, Feeder, Model, Stamp, UNIT, library, project};

use crate::fixture::{Fixture, assert_shows_the_ball, quick, scene};

/// Returns the next pair; ignores lost ones.
fn next(camera: &mut Camera) -> Pair {
    for _ in 0..100 {
        match camera.next_pair() {
            Ok(Some(pair)) => return pair,
            Ok(None) => panic!("a camera does not end"),
            Err(error) => assert!(error.is_transient(), "{error}"),
        }
    }
    panic!("100 pictures were lost");
}

#[test]
fn a_camera_is_listed_opened_and_aligned() {
    let Some(fixture) = Fixture::new("live") else { return };
    let name = "Plumb software camera".to_owned();
    let listed = DeviceInfo { serial: "live".to_owned(), name: name.clone() };
    assert!(fixture.library.devices().unwrap().contains(&listed));

    let mut camera = fixture.open(Settings { latency: 0.0, ..Settings::default() }).unwrap();
    let opened = camera.opened().clone();
    assert_eq!((opened.id.as_str(), opened.name), ("live", name));
    assert_eq!(opened.mode, Mode { width: 640, height: 480, rate: 30 });
    assert_eq!(opened.depth_unit, UNIT);
    let intrinsics = opened.intrinsics;
    assert_eq!((intrinsics.fx, intrinsics.cx, intrinsics.cy), (525.0, 319.5, 239.5));
    assert_eq!(intrinsics.largest_distortion(opened.mode), Some(0.0));

    let _feeder = Feeder::start(Arc::clone(&fixture.device), scene());
    let mut last = 0.0;
    for _ in 0..10 {
        let pair = next(&mut camera);
        assert_shows_the_ball(&pair);
        assert!(pair.time > last && pair.time <= camera.now(), "{} after {last}", pair.time);
        last = pair.time;
    }
}

#[test]
fn exposure_and_projector_are_set() {
    let Some(fixture) = Fixture::new("options") else { return };
    let settings = Settings { exposure: Some(0.008), emitter: Some(false), ..quick() };
    drop(fixture.open(settings).unwrap());
    assert_eq!(fixture.device.options(), Ok((80.0, false)));
    drop(fixture.open(Settings { emitter: Some(true), ..quick() }).unwrap());
    assert_eq!(fixture.device.options(), Ok((80.0, true)));
    let long = fixture.open(Settings { exposure: Some(2.0), ..quick() });
    let text = long.unwrap_err().to_string();
    assert!(text.contains("20000 is not between 0 and 10000"), "{text}");
}

#[test]
fn colour_and_depth_of_one_sensor_are_opened_together() {
    let model = Model { has_one_sensor: true, ..Model::default() };
    let Some(fixture) = Fixture::with_model("one-sensor", model) else { return };
    let mut camera = fixture.open(Settings { exposure: Some(0.008), ..quick() }).unwrap();
    // The exposure of a depth sensor is in microseconds.
    assert_eq!(fixture.device.options().unwrap().0, 8000.0);
    fixture.send(1000.0, 1000.0);
    assert_shows_the_ball(&camera.next_pair().unwrap().unwrap());
}

#[test]
fn the_library_projects_by_the_inverse_model_as_by_that_of_brown_and_conrady() {
    let Some(library) = library().unwrap() else { return };
    // A D455 (librealsense issue 9551).
    let coefficients = [-0.0565, 0.0682, 0.0004, 0.0007, -0.0218];
    let lens = |model| RawIntrinsics {
        width: 1280,
        height: 720,
        ppx: 639.5,
        ppy: 359.5,
        fx: 640.0,
        fy: 640.0,
        model,
        coefficients,
    };
    for point in [[0.0, 0.0, 1.0], [0.9, 0.5, 1.0], [-0.6, 0.3, 1.0], [0.2, -0.5, 1.0]] {
        let [inverse, plain] = [2, 4].map(|model| project(&library, &lens(model), point).unwrap());
        let distance = (inverse[0] - plain[0]).hypot(inverse[1] - plain[1]);
        assert!(distance < 0.05, "{point:?}: {inverse:?} {plain:?}");
    }
}

#[test]
fn pictures_are_paired_by_their_time_stamps() {
    let Some(fixture) = Fixture::new("pairs") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    // A pair in step, one that is 10 ms apart, one that is half a period apart.
    fixture.send(1000.000, 1000.000);
    assert_shows_the_ball(&camera.next_pair().unwrap().unwrap());
    fixture.send(1000.033, 1000.043);
    assert_shows_the_ball(&camera.next_pair().unwrap().unwrap());
    fixture.send(1000.067, 1000.084);
    let error = camera.next_pair().unwrap_err();
    assert!(error.is_transient(), "{error}");
    assert!(matches!(error, RealsenseError::Unpaired { sensor: Sensor::Colour, .. }), "{error}");
    // A depth picture was lost; the next pair is whole.
    fixture.send(1000.100, 1000.100);
    let error = camera.next_pair().unwrap_err();
    assert!(matches!(error, RealsenseError::Unpaired { sensor: Sensor::Depth, .. }), "{error}");
    assert_shows_the_ball(&camera.next_pair().unwrap().unwrap());
}

#[test]
fn a_picture_is_as_old_as_its_time_stamp_says() {
    let Some(fixture) = Fixture::new("ages") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    fixture.send(1000.0, 1000.0);
    let first = camera.next_pair().unwrap().unwrap().time;
    // Taken 50 ms after the first pair, and delivered 400 ms after it.
    std::thread::sleep(Duration::from_millis(400));
    fixture.send(1000.05, 1000.05);
    let second = camera.next_pair().unwrap().unwrap().time;
    // A drift of 1 ms a second is allowed for.
    assert!((second - first - 0.05).abs() < 1e-3, "{second} after {first}");
    assert!(camera.now() - second > 0.34, "{second} at {}", camera.now());
}

#[test]
fn depth_that_comes_a_period_late_is_paired_and_makes_no_picture_younger() {
    let Some(fixture) = Fixture::new("late-depth") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    let (scene, period) = (scene(), 1.0 / 30.0);
    let depth = |number: u32| {
        let stamp = Stamp::at(1000.0 + period * f64::from(number));
        fixture.device.send_depth(&scene, stamp, UNIT).unwrap();
    };
    let mut ages = Vec::new();
    for number in 0..6 {
        let stamp = Stamp::at(1000.0 + period * f64::from(number));
        fixture.device.send_colour(&scene, stamp).unwrap();
        std::thread::sleep(Duration::from_secs_f64(period));
        if number > 0 {
            depth(number - 1);
            let pair = camera.next_pair().unwrap().unwrap();
            ages.push(camera.now() - pair.time);
        }
    }
    // The first colour picture is read when its depth has come, each other one a period before.
    assert!(ages[1..].iter().all(|age| *age >= period), "{ages:?}");
}

#[test]
fn pictures_of_different_clocks_are_refused() {
    let Some(fixture) = Fixture::new("clocks") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    fixture.device.send_depth(&scene(), Stamp::at(1000.0), UNIT).unwrap();
    let system = Stamp { time: 1.7e9, domain: 1 };
    fixture.device.send_colour(&scene(), system).unwrap();
    assert_eq!(camera.next_pair(), Err(RealsenseError::Clocks));
    // The colour sensor changes to the camera's clock.
    fixture.send(1000.033, 1000.033);
    assert_shows_the_ball(&next(&mut camera));
}

#[test]
fn a_picture_in_other_units_of_depth_is_refused() {
    let Some(fixture) = Fixture::new("other-unit") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    fixture.device.send_colour(&scene(), Stamp::at(1000.0)).unwrap();
    fixture.device.send_depth(&scene(), Stamp::at(1000.0), 0.0001).unwrap();
    let error = camera.next_pair().unwrap_err();
    assert!(matches!(error, RealsenseError::OtherDepthUnit { .. }), "{error}");
    fixture.send(1000.033, 1000.033);
    assert_shows_the_ball(&camera.next_pair().unwrap().unwrap());
}

#[test]
fn a_camera_that_falls_silent_is_an_error_in_bounded_time() {
    let Some(fixture) = Fixture::new("silent") else { return };
    let mut camera = fixture.open(quick()).unwrap();
    let feeder = Feeder::start(Arc::clone(&fixture.device), scene());
    next(&mut camera);
    feeder.show(Control { silent: true, ..scene() });
    let start = Instant::now();
    let error = loop {
        match camera.next_pair() {
            Err(error) if !error.is_transient() => break error,
            _ => assert!(start.elapsed() < Duration::from_secs(60), "no error"),
        }
    };
    assert!(matches!(error, RealsenseError::Silent { .. }), "{error}");
    assert_eq!(camera.next_pair(), Err(error));
    // Depth alone makes no pairs.
    drop(camera);
    let mut camera = fixture.open(quick()).unwrap();
    feeder.show(Control { blind: true, ..scene() });
    let error = (0..10).find_map(|_| camera.next_pair().err()).unwrap();
    assert!(matches!(error, RealsenseError::Unpaired { sensor: Sensor::Colour, .. }), "{error}");
}

#[test]
fn an_unplugged_camera_is_an_error_before_it_counts_as_silent() {
    let Some(fixture) = Fixture::with_fault(Fault::Unplugged) else { return };
    // The pictures come from a software device, which lives although it is unplugged.
    let settings = Settings { timeout: Duration::from_secs(60), ..quick() };
    let mut camera = fixture.open(settings).unwrap();
    fixture.send(1000.0, 1000.0);
    next(&mut camera);
    let error = camera.next_pair().unwrap_err();
    assert!(matches!(error, RealsenseError::Unplugged { .. }), "{error}");
    assert!(!error.is_transient());
    assert_eq!(camera.next_pair(), Err(error));
}

#[test]
fn a_camera_that_does_not_open_is_an_error_in_bounded_time() {
    let Some(fixture) = Fixture::with_fault(Fault::Hangs) else { return };
    let settings = Settings { open_timeout: Duration::from_millis(300), ..quick() };
    let error = fixture.open(settings).unwrap_err();
    assert!(matches!(error, RealsenseError::Hangs { .. }), "{error}");
    assert!(error.to_string().starts_with("faulty: ") && error.to_string().contains("USB 3"));
}

#[test]
fn the_first_camera_is_taken_where_none_is_named() {
    let Some(fixture) = Fixture::new("first") else { return };
    let camera = Camera::open(&fixture.library, &Target::First, quick()).unwrap();
    assert_eq!(camera.opened().name, "Plumb software camera");
}
