//! Balls of every colour that `plumb init` names: the simulated rig shows the one that the camera
//! file describes.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use plumb_cameras::camera_file;
use plumb_emulator::plant::Task;
use plumb_frame::camera::Camera;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::VirtualBoard;
use plumb_vision::detect::DetectorKind;

#[test]
fn a_ball_of_any_colour_is_driven_to_its_target() {
    let rig = Rig::paper().unwrap();
    for ball_hue in [30.0, 60.0, 120.0, 180.0, 240.0, 270.0, 285.0, 330.0] {
        let camera = Camera { ball_hue, ..camera_file::paper().unwrap() };
        let board = VirtualBoard::paper().unwrap();
        let mut source = board.camera(&camera, *Task::paper().geometry.motors(), 1).unwrap();
        let mut detector = DetectorKind::Ball.build(&camera);
        let run = Run::connect(&rig, board.transport()).unwrap();
        let summary = run.drive(RunParts::new(&mut source, &mut *detector)).unwrap();
        assert!(summary.reached, "{ball_hue}: {summary:?}");
        assert!(summary.located * 100 >= summary.frames * 99, "{ball_hue}: {summary:?}");
    }
}
