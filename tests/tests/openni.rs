//! The paper's task with images from the real libOpenNI2, in real time. The test driver renders the
//! ball of the emulated board's rig; the board is on a pseudo-terminal.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::source::openni::{IntrinsicsSource, OpenniSource};
use plumb_emulator::plant::{QuasiStatic, Task};
use plumb_emulator::{EMULATED, EmulatedBoard, serve};
use plumb_openni::{OpenNi, Settings, Target};
use plumb_openni_driver::{Control, ControlFile};
use plumb_runtime::link::Serial;
use plumb_runtime::rig::{LawName, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_vision::camera::Camera;
use plumb_vision::detect::DetectorKind;

/// Returns the paper's rig file with a higher gain, and with deadlines for a busy machine.
fn rig() -> Rig {
    let paper = Rig::paper().expect("the paper's rig file");
    let mut rig = Rig { law: LawName::Interval.into(), ..paper };
    rig.law.set_gamma(150.0).expect("a gain");
    let seconds = |s: f64| s.try_into().expect("seconds");
    rig.deadlines.host = seconds(5.0);
    rig.deadlines.position = seconds(5.0);
    rig.deadlines.max_age = seconds(4.9);
    rig
}

/// Returns the driver's settings for a ball at `ball` (rig frame, m).
fn ball_view(camera: &Camera, ball: Point3<f64>) -> Control {
    let ball = camera.pose.inverse_transform_point(&ball);
    Control { ball: Some(ball.into()), diameter: camera.ball_diameter, ..Control::default() }
}

#[test]
fn a_run_with_libopenni2_reaches_the_papers_target() {
    let folder = tempfile::tempdir().expect("a folder");
    let library = match plumb_openni_driver::stage(folder.path(), true) {
        Ok(library) => library,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "{error}");
            return println!("skipped: {error}");
        }
    };
    let (rig, camera, task) =
        (rig(), camera_file::paper().expect("the paper's camera"), Task::paper());
    let plant = QuasiStatic::new(task.geometry, task.start).expect("the paper's rig");
    let served = Arc::new(
        serve(EmulatedBoard::with_plant(EMULATED, Box::new(plant))).expect("a pseudo-terminal"),
    );
    let path = folder.path().join("control");
    let mut control =
        ControlFile::create(&path, &ball_view(&camera, task.start)).expect("a control file");
    let uri = control.uri();

    // The camera looks at the rig.
    let over = Arc::new(AtomicBool::new(false));
    let eye = {
        let (over, served, camera) = (Arc::clone(&over), Arc::clone(&served), camera.clone());
        thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                let ball = served.board().ball().expect("a rig");
                control.write(&ball_view(&camera, ball)).expect("the control file");
                thread::sleep(Duration::from_millis(2));
            }
        })
    };

    let openni = OpenNi::load_from(&library).expect("the library");
    let settings = Settings { latency: 0.005, ..Settings::default() };
    let mut source =
        OpenniSource::open(&openni, &Target::Uri(uri), settings, IntrinsicsSource::FieldOfView)
            .expect("the camera");
    let camera = Camera { intrinsics: *source.intrinsics(), ..camera };
    let transport =
        Serial::open(&served.path().to_string_lossy(), rig.board.baud).expect("the board's port");
    let (mut detector, interrupted) = (DetectorKind::Ball.build(&camera), AtomicBool::new(false));
    let run = Run::connect(&rig, transport).expect("a configured board");
    let result = run.drive(RunParts {
        source: &mut source,
        detector: &mut *detector,
        observers: &mut [],
        operator: None,
        timeout: 60.0,
        interrupted: &interrupted,
    });
    over.store(true, Ordering::Relaxed);
    eye.join().expect("the camera's eye");
    let summary = result.expect("an unbroken run");
    assert!(summary.reached, "{summary:?}");
    // 114 periods by the law, without latency.
    assert!(summary.located > 60 && summary.lost < summary.frames / 10, "{summary:?}");
    let error = (served.board().ball().expect("a rig") - task.target).norm();
    assert!(error < 0.010, "{error} m from the target: {summary:?}");
    println!("{summary:?}, {:.2} mm from the target", error * 1e3);
}
