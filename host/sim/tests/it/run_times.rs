//! Times of the frames of a run.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use plumb_cameras::camera_file;
use plumb_emulator::plant::Task;
use plumb_frame::source::CameraSource;
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::VirtualBoard;
use plumb_vision::detect::DetectorKind;

/// Observer that notes the times of the frames, seconds.
#[derive(Default)]
struct Times(Vec<f64>);

impl Observer for Times {
    fn frame(&mut self, record: &FrameRecord) {
        self.0.push(record.time);
    }
}

#[test]
fn times_begin_at_the_first_frame_and_rise_over_all_targets() {
    let mut rig = Rig::paper().unwrap();
    rig.set_targets(&[[0.52, 0.24, 0.42], [0.50, 0.26, 0.38], [0.54, 0.22, 0.45]]).unwrap();
    let (board, camera) = (VirtualBoard::paper().unwrap(), camera_file::paper().unwrap());
    let mut source = board.camera(&camera, *Task::paper().geometry.motors(), 1).unwrap();
    // The camera runs before the run begins: the next frame is taken by then, and on its way.
    source.next_frame().unwrap();
    let mut detector = DetectorKind::Ball.build(&camera);
    let mut times = Times::default();
    let run = Run::connect(&rig, board.transport()).unwrap();
    let parts =
        RunParts { observers: &mut [&mut times], ..RunParts::new(&mut source, &mut *detector) };
    let summary = run.drive(parts).unwrap();
    assert!(summary.reached && summary.targets_reached == 3, "{summary:?}");
    let times = times.0;
    assert_eq!(times.len() as u64, summary.frames);
    assert_eq!(times.first(), Some(&0.0));
    assert!(times.is_sorted_by(|earlier, later| earlier < later), "{times:?}");
    assert!((summary.time_s - times.last().unwrap()).abs() < 1e-6, "{summary:?}");
}
