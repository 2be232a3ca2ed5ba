//! Tests of `plumb-openni` with the real libOpenNI2 and the camera of this crate.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use plumb_openni::{Camera, OpenNi, OpenniError, Pair, Settings, Target, Timeouts};
use plumb_openni_driver::{Control, ControlFile, FOCAL_LENGTH};
use tempfile::TempDir;

/// Returns the library with this crate's driver; `None` if it is not installed (an error with CI
/// set).
fn openni() -> Option<&'static OpenNi> {
    static OPENNI: OnceLock<Option<(TempDir, OpenNi)>> = OnceLock::new();
    let staged = OPENNI.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        match plumb_openni_driver::stage(folder.path(), true) {
            Ok(library) => Some((folder, OpenNi::load_from(&library).unwrap())),
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "{error}");
                println!("skipped: {error}");
                None
            }
        }
    });
    staged.as_ref().map(|(_, openni)| openni)
}

/// A camera and its control file.
struct Told {
    folder: TempDir,
    file: ControlFile,
}

impl Told {
    fn new(control: &Control) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = ControlFile::create(&folder.path().join("control"), control).unwrap();
        Self { folder, file }
    }

    fn open(&self, settings: Settings) -> Result<Camera, OpenniError> {
        Camera::open(openni().unwrap(), &Target::Uri(self.file.uri()), settings)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn quick() -> Timeouts {
    Timeouts { picture: Duration::from_millis(500), ..Timeouts::default() }
}

/// Returns the pixel of the red ball, and its smallest depth, mm.
fn seen(pair: &Pair, width: usize) -> (f64, f64, u16) {
    let red = |p: &[u8]| i32::from(p[0]) - i32::from(p[1].max(p[2])) > 40;
    let hits: Vec<usize> =
        (0..pair.depth.len()).filter(|&i| red(&pair.colour[3 * i..3 * i + 3])).collect();
    let mean = |f: &dyn Fn(usize) -> usize| {
        hits.iter().map(|&i| f(i) as f64).sum::<f64>() / hits.len() as f64
    };
    let (u, v) = (mean(&|i| i % width), mean(&|i| i / width));
    (u, v, pair.depth[v.round() as usize * width + u.round() as usize])
}

/// Returns the next pair; ignores lost ones.
fn next(camera: &mut Camera) -> Pair {
    loop {
        match camera.next_pair() {
            Ok(Some(pair)) => return pair,
            Ok(None) => panic!("a camera does not end"),
            Err(error) => assert!(error.is_transient(), "{error}"),
        }
    }
}

#[test]
fn a_live_camera_is_registered_unmirrored_and_of_the_requested_size() {
    if openni().is_none() {
        return;
    }
    let told = Told::new(&Control { ball: Some([0.25, -0.1, 1.2]), ..Control::default() });
    let mut camera = told.open(Settings { latency: 0.0, ..Settings::default() }).unwrap();
    let opened = camera.opened().clone();
    assert_eq!((opened.mode.width, opened.mode.height, opened.mode.rate), (640, 480, 30));
    assert_eq!(opened.notes, [""; 0]);
    let (horizontal, vertical) = opened.field_of_view.unwrap();
    assert!((320.0 / (horizontal / 2.0).tan() - FOCAL_LENGTH).abs() < 0.01);
    assert!((240.0 / (vertical / 2.0).tan() - FOCAL_LENGTH).abs() < 0.01);
    let mut last = 0.0;
    for _ in 0..10 {
        let pair = next(&mut camera);
        // The principal point is (319.5, 239.5).
        let (u, v, z) = seen(&pair, 640);
        let k = FOCAL_LENGTH / 1.2;
        assert!(
            (u - 319.5 - 0.25 * k).abs() < 0.5 && (v - 239.5 + 0.1 * k).abs() < 0.5,
            "({u}, {v})"
        );
        assert!((1159..1166).contains(&z), "{z}");
        assert!(pair.time > last && pair.time <= camera.now(), "{} after {last}", pair.time);
        last = pair.time;
    }
    camera.close().unwrap();
}

#[test]
fn unsupported_features_are_reported() {
    if openni().is_none() {
        return;
    }
    let refused = |control: Control, settings: Settings| {
        Told::new(&control).open(settings).map(|camera| camera.opened().clone())
    };
    let good = Control::default();
    let says = |result: Result<_, OpenniError>, parts: &[&str]| {
        let text = result.map(|_: plumb_openni::Opened| ()).unwrap_err().to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{parts:?} in {text}");
    };
    let wide = Settings { width: 1280, height: 1024, ..Settings::default() };
    says(
        refused(good, wide),
        &["colour", "1280x1024 at 30 Hz", "320x240 at 30 Hz, 640x480 at 30 Hz"],
    );
    let fast = Settings { rate: 60, ..Settings::default() };
    says(refused(good, fast), &["640x480 at 60 Hz", "320x240 at 30 Hz"]);
    says(
        refused(Control { no_registration: true, ..good }, Settings::default()),
        &["registration"],
    );
    let kept = refused(Control { keeps_mode: true, ..good }, Settings::default());
    says(kept, &["size and rate", "640x480", "320x240"]);
    says(
        refused(Control { keeps_mirroring: true, ..good }, Settings::default()),
        &["mirroring off", "still on"],
    );
    let opened = refused(Control { no_sync: true, ..good }, Settings::default()).unwrap();
    assert!(opened.notes[0].contains("synchronisation"), "{:?}", opened.notes);
    let slow = Settings {
        timeouts: Timeouts { open: Duration::from_millis(100), ..quick() },
        ..Settings::default()
    };
    says(refused(Control { slow: 1.0, ..good }, slow), &["does not return from opening it"]);
    let absent = Camera::open(
        openni().unwrap(),
        &Target::Uri("plumb-test:/no/such".to_owned()),
        Settings::default(),
    );
    says(
        absent.map(|camera| camera.opened().clone()),
        &["plumb-test:/no/such", "cannot be opened"],
    );
}

#[test]
fn frames_without_synchronisation_are_paired_by_time() {
    if openni().is_none() {
        return;
    }
    let told = Told::new(&Control { no_sync: true, depth_late: 0.010, ..Control::default() });
    let mut camera = told.open(Settings::default()).unwrap();
    for _ in 0..5 {
        next(&mut camera);
    }
}

/// Returns the camera's first permanent error.
fn lasting(camera: &mut Camera) -> OpenniError {
    loop {
        match camera.next_pair() {
            Ok(pair) => assert!(pair.is_some()),
            Err(error) if error.is_transient() => {}
            Err(error) => return error,
        }
    }
}

#[test]
fn unplugging_is_a_permanent_error() {
    if openni().is_none() {
        return;
    }
    let mut told = Told::new(&Control::default());
    let mut camera = told.open(Settings::default()).unwrap();
    next(&mut camera);
    told.file.write(&Control { plugged: false, ..Control::default() }).unwrap();
    let error = lasting(&mut camera);
    assert_eq!(error, OpenniError::Unplugged { uri: told.file.uri() });
    assert_eq!(camera.next_pair(), Err(error));
    camera.close().unwrap();
    // After plugging in, it is a new camera.
    told.file.write(&Control::default()).unwrap();
}

#[test]
fn a_silent_camera_is_an_error() {
    if openni().is_none() {
        return;
    }
    let mut told = Told::new(&Control::default());
    let mut camera = told.open(Settings { timeouts: quick(), ..Settings::default() }).unwrap();
    next(&mut camera);
    told.file.write(&Control { silent: true, ..Control::default() }).unwrap();
    assert!(matches!(lasting(&mut camera), OpenniError::Silent { .. }));
    camera.close().unwrap();
}

#[test]
fn a_stopped_stream_and_unpaired_streams_are_errors() {
    if openni().is_none() {
        return;
    }
    for (depth_late, blind, no_sync, says) in [
        (0.016, false, false, "within 13 ms"),
        (0.030, false, false, "out of step"),
        (0.016, false, true, "within 13 ms"),
        (0.0, true, true, "within 13 ms"),
    ] {
        let told = Told::new(&Control { depth_late, blind, no_sync, ..Control::default() });
        let mut camera = told.open(Settings::default()).unwrap();
        assert_eq!(camera.opened().notes.is_empty(), !no_sync);
        for _ in 0..5 {
            let error = camera.next_pair().map(|pair| pair.map(|pair| pair.time)).unwrap_err();
            assert!(error.is_transient() && error.to_string().contains(says), "{says} in {error}");
        }
    }
    // With pairing by the library, no frame arrives.
    let told = Told::new(&Control { blind: true, ..Control::default() });
    let mut camera = told.open(Settings { timeouts: quick(), ..Settings::default() }).unwrap();
    assert!(matches!(lasting(&mut camera), OpenniError::Silent { .. }));
}

#[test]
fn a_frame_of_another_size_is_refused_and_the_next_accepted() {
    if openni().is_none() {
        return;
    }
    let mut told = Told::new(&Control { rows_missing: 8, ..Control::default() });
    let mut camera = told.open(Settings::default()).unwrap();
    let error = camera.next_pair().unwrap_err();
    assert!(error.to_string().contains("640x472") && error.is_transient(), "{error}");
    told.file.write(&Control::default()).unwrap();
    next(&mut camera);
}

/// Records at least `count` pairs at that rate and returns the file.
fn record(told: &mut Told, count: usize) -> PathBuf {
    let path = told.path("recording.oni");
    let settings = Settings { record: Some(path.clone()), ..Settings::default() };
    let mut camera = told.open(settings).unwrap();
    for i in 0..count {
        next(&mut camera);
        let ball = Some([0.01 * i as f64, 0.0, 1.2]);
        told.file.write(&Control { ball, ..Control::default() }).unwrap();
    }
    camera.close().unwrap();
    path
}

/// Returns all pairs of a recording, and its end.
fn play(path: &Path) -> (Vec<Pair>, Vec<OpenniError>, Result<(), OpenniError>) {
    let settings = Settings::default();
    let mut camera =
        match Camera::open(openni().unwrap(), &Target::Recording(path.to_owned()), settings) {
            Ok(camera) => camera,
            Err(error) => return (Vec::new(), Vec::new(), Err(error)),
        };
    let (mut pairs, mut problems) = (Vec::new(), Vec::new());
    loop {
        match camera.next_pair() {
            Ok(Some(pair)) => pairs.push(pair),
            Ok(None) => return (pairs, problems, camera.close()),
            Err(error) if error.is_transient() => problems.push(error),
            Err(error) => return (pairs, problems, Err(error)),
        }
    }
}

#[test]
fn a_recording_is_played_completely() {
    if openni().is_none() {
        return;
    }
    let mut told = Told::new(&Control::default());
    let path = record(&mut told, 20);
    let (pairs, problems, end) = play(&path);
    assert_eq!(end, Ok(()));
    assert_eq!(problems, []);
    assert!(pairs.len() >= 20, "{}", pairs.len());
    for (i, two) in pairs.windows(2).enumerate() {
        let (before, after) = (seen(&two[0], 640), seen(&two[1], 640));
        assert!(two[1].time > two[0].time && after.0 >= before.0 - 0.01, "picture {i}");
        assert!(
            (1159..1166).contains(&after.2),
            "picture {i}: colour and depth are apart ({after:?})"
        );
    }
    // A second time.
    assert_eq!(play(&path), (pairs, problems, end));
}

#[test]
fn a_damaged_recording_is_an_error_and_never_blocks() {
    if openni().is_none() {
        return;
    }
    let mut told = Told::new(&Control::default());
    let path = record(&mut told, 10);
    let whole = std::fs::read(&path).unwrap();
    let (all, _, _) = play(&path);
    let cut = told.path("cut.oni");
    for part in
        [0, 3, 20, 200, 1000, whole.len() / 3, whole.len() / 2, whole.len() - 5000, whole.len() - 1]
    {
        std::fs::write(&cut, &whole[..part]).unwrap();
        let (pairs, _, end) = play(&cut);
        let error = end.unwrap_err().to_string();
        let says = if part < 4 { "no .oni recording" } else { "truncated" };
        assert!(
            pairs.is_empty() && error.contains(says) && error.contains("cut.oni"),
            "{part}: {error}"
        );
    }
    // A byte of a compressed depth frame.
    let mut flipped = whole.clone();
    flipped[2100] ^= 0x55;
    std::fs::write(&cut, &flipped).unwrap();
    let (pairs, problems, end) = play(&cut);
    assert_eq!(end, Ok(()));
    assert!(pairs.len() + problems.len() >= all.len(), "{} and {problems:?}", pairs.len());
    let (_, _, end) = play(&told.path("absent.oni"));
    assert!(end.unwrap_err().to_string().contains("absent.oni"));
    std::fs::write(&cut, b"# no recording").unwrap();
    let (_, _, end) = play(&cut);
    assert!(end.unwrap_err().to_string().contains("no .oni recording"));
}
