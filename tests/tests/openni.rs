//! The paper's task with images from the real libOpenNI2, in real time. The test driver renders the
//! ball of the emulated board's rig.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::error::Error;
use std::path::Path;

use nalgebra::Point3;
use plumb_openni::{IntrinsicsSource, OpenNi, Settings, Target};
use plumb_openni_driver::{Control, ControlFile};
use plumb_runtime::run::Summary;
use plumb_tests::in_time::in_time;
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
    let (summary, error) =
        in_time(|| paper_task(&library, folder.path())).expect("an unbroken run");
    assert!(summary.reached, "{summary:?}");
    // 114 periods by the law, without latency. A busy computer loses pictures, and the law takes
    // longer; the ball is in each that comes.
    assert!(summary.located > 60 && summary.located == summary.frames, "{summary:?}");
    assert!(error < 0.010, "{error} m from the target: {summary:?}");
    println!("{summary:?}, {:.2} mm from the target", error * 1e3);
}

/// Does the task with a new board. The control file of the camera is in `folder`. Returns the
/// summary and the ball's distance from the target, metres.
fn paper_task(library: &Path, folder: &Path) -> Result<(Summary, f64), Box<dyn Error>> {
    let rig = LiveRig::serve()?;
    let diameter = rig.camera.ball_diameter;
    let scene =
        |ball: Point3<f64>| Control { ball: Some(ball.into()), diameter, ..Control::default() };
    let mut control = ControlFile::create(&folder.join("control"), &scene(rig.start()))?;
    let uri = control.uri();

    let openni = OpenNi::load_from(library)?;
    let settings = Settings { latency: 0.005, ..Settings::default() };
    let mut source = plumb_openni::open_source(
        &openni,
        &Target::Uri(uri),
        settings,
        IntrinsicsSource::FieldOfView,
    )?;
    let intrinsics = source.intrinsics;
    let show = |ball| control.write(&scene(ball)).expect("the control file");
    rig.run(&mut source, intrinsics, show)
}
