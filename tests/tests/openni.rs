//! The paper's task with images from the real libOpenNI2, in real time. The test driver renders the
//! ball of the emulated board's rig.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use nalgebra::Point3;
use plumb_openni::{IntrinsicsSource, OpenNi, OpenniSource, Settings, Target};
use plumb_openni_driver::{Control, ControlFile};
use plumb_tests::live_camera::LiveRig;

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
    let rig = LiveRig::serve().expect("the paper's rig");
    let diameter = rig.camera.ball_diameter;
    let scene =
        |ball: Point3<f64>| Control { ball: Some(ball.into()), diameter, ..Control::default() };
    let path = folder.path().join("control");
    let mut control = ControlFile::create(&path, &scene(rig.start())).expect("a control file");
    let uri = control.uri();

    let openni = OpenNi::load_from(&library).expect("the library");
    let settings = Settings { latency: 0.005, ..Settings::default() };
    let mut source =
        OpenniSource::open(&openni, &Target::Uri(uri), settings, IntrinsicsSource::FieldOfView)
            .expect("the camera");
    let intrinsics = *source.intrinsics();
    let show = |ball| control.write(&scene(ball)).expect("the control file");
    let (summary, error) = rig.run(&mut source, intrinsics, show).expect("an unbroken run");
    assert!(summary.reached, "{summary:?}");
    // 114 periods by the law, without latency.
    assert!(summary.located > 60 && summary.lost < summary.frames / 10, "{summary:?}");
    assert!(error < 0.010, "{error} m from the target: {summary:?}");
    println!("{summary:?}, {:.2} mm from the target", error * 1e3);
}
