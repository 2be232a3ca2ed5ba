//! The paper's task with images from the real librealsense2, in real time. Its software device
//! shows the ball of the emulated board's rig.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::error::Error;
use std::sync::Arc;

use nalgebra::Point3;
use plumb_realsense::{RealSense, Settings, Target};
use plumb_realsense_device::{Control, Feeder, Model, SoftwareCamera, library};
use plumb_runtime::run::Summary;
use plumb_tests::in_time::in_time;
use plumb_tests::live_camera::LiveRig;

#[test]
fn a_run_with_librealsense2_reaches_the_papers_target() {
    let Some(library) = library().expect("the library") else { return };
    let (summary, error) = in_time(|| paper_task(&library)).expect("an unbroken run");
    assert!(summary.reached, "{summary:?}");
    // 114 periods by the law, without latency. A busy computer loses pictures, and the law takes
    // longer; the ball is in each that comes.
    assert!(summary.located > 60 && summary.located == summary.frames, "{summary:?}");
    assert!(error < 0.010, "{error} m from the target: {summary:?}");
    println!("{summary:?}, {:.2} mm from the target", error * 1e3);
}

/// Does the task with a new camera and board. Returns the summary and the ball's distance from the
/// target, metres.
fn paper_task(library: &RealSense) -> Result<(Summary, f64), Box<dyn Error>> {
    let rig = LiveRig::serve()?;
    let diameter = rig.camera.ball_diameter;
    let scene =
        |ball: Point3<f64>| Control { ball: Some(ball.into()), diameter, ..Control::default() };
    let device = SoftwareCamera::plug_in(library, "paper", Model::default())?;
    let feeder = Feeder::start(Arc::new(device), scene(rig.start()));

    let settings = Settings { latency: 0.005, ..Settings::default() };
    let target = Target::Serial("paper".to_owned());
    let mut source = plumb_realsense::open_source(library, &target, settings, None)?;
    let intrinsics = source.intrinsics;
    rig.run(&mut source, intrinsics, |ball| feeder.show(scene(ball)))
}
