//! Runs whose pictures lie: a wrong scale of depth, a camera that is knocked, a second ball.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::sync::atomic::AtomicBool;

use nalgebra::{Point3, Vector3};
use plumb_cameras::camera_file;
use plumb_emulator::plant::{Geometry, Task};
use plumb_frame::source::{CameraSource, SourceError};
use plumb_runtime::doubt::Doubt;
use plumb_runtime::observer::RunEvent;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunParts, StopReason, Summary};
use plumb_sim::simulated::{SimulatedCamera, Timing, VirtualBoard};
use plumb_sim::synthetic::{RenderOptions, Scene, SyntheticCamera};
use plumb_tests::links::{FixedDetector, TrackingCamera, link};
use plumb_tests::plain_room;
use plumb_vision::camera::{Camera, Intrinsics};
use plumb_vision::detect::{BallDetector, DetectError, DetectorKind};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::{BallObservation, Gaussian3};

/// A camera whose pictures are altered.
struct Altered<S, F>(S, F);

impl<S: CameraSource, F: FnMut(RgbdFrame) -> RgbdFrame> CameraSource for Altered<S, F> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        Ok(self.0.next_frame()?.map(&mut self.1))
    }

    fn now(&self) -> f64 {
        self.0.now()
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// Drives the paper's task. `taken` takes the pictures, which `alter` changes, and `known` is the
/// camera of the camera file.
fn drive(taken: &Camera, known: &Camera, alter: impl FnMut(RgbdFrame) -> RgbdFrame) -> Summary {
    let rig = Rig::paper().unwrap();
    let board = VirtualBoard::paper().unwrap();
    let options = RenderOptions::default();
    let synthetic =
        SyntheticCamera::new(taken.clone(), plain_room::background(), options, 1).unwrap();
    let motors = *Geometry::paper().motors();
    let source = SimulatedCamera::new(board.rig(), synthetic, motors, Timing::default());
    let run = Run::connect(&rig, board.transport()).unwrap();
    let summary = run.drive(RunParts {
        source: &mut Altered(source, alter),
        detector: &mut *DetectorKind::Ball.build(known),
        observers: &mut [],
        operator: None,
        timeout: 30.0,
        interrupted: &AtomicBool::new(false),
    });
    summary.unwrap()
}

/// Returns `frame` with its depth at (u, v) times a factor.
fn scaled(frame: &RgbdFrame, factor: impl Fn(&Intrinsics, (f64, f64)) -> f64) -> RgbdFrame {
    let (mut depth, intrinsics) = (frame.depth().clone(), *frame.intrinsics());
    let width = depth.width();
    for (i, depth) in depth.pixels_mut().iter_mut().enumerate() {
        let factor = factor(&intrinsics, ((i % width) as f64, (i / width) as f64));
        *depth = (f64::from(*depth) * factor).round().min(65535.0) as u16;
    }
    RgbdFrame::new(frame.time(), frame.colour().clone(), depth, intrinsics).unwrap()
}

fn doubts(summary: &Summary) -> Vec<Doubt> {
    let doubt = |event: &RunEvent| match event {
        RunEvent::Doubt(doubt) => Some(*doubt),
        _ => None,
    };
    summary.events.iter().filter_map(|record| doubt(&record.event)).collect()
}

#[test]
fn depth_of_a_wrong_scale_reaches_nothing_and_is_named() {
    let camera = camera_file::paper().unwrap();
    for factor in [0.7, 0.85, 0.9, 1.0, 1.02, 1.1, 1.15, 1.3] {
        let summary = drive(&camera, &camera, |frame| scaled(&frame, |_, _| factor));
        let doubts = doubts(&summary);
        println!("{factor}: {}, {doubts:?}", summary.ending);
        if (factor - 1.0).abs() < 0.03 {
            assert!(summary.reached && doubts.is_empty(), "{factor}: {summary:?}");
            continue;
        }
        assert!(!summary.reached, "{factor}: {summary:?}");
        let [doubt @ Doubt::Depth(depths)] = doubts[..] else { panic!("{factor}: {summary:?}") };
        assert!((depths.difference() - (factor - 1.0)).abs() < 0.03, "{factor}: {depths:?}");
        let line = doubt.to_string();
        assert!(line.contains("ball.diameter") && line.contains("depth_scale"), "{line}");
    }
}

#[test]
fn a_wrong_diameter_is_named_as_a_wrong_scale_is() {
    let camera = camera_file::paper().unwrap();
    for factor in [0.9, 1.12] {
        let known = Camera { ball_diameter: camera.ball_diameter * factor, ..camera.clone() };
        let summary = drive(&camera, &known, |frame| frame);
        println!("{factor}: {}", summary.ending);
        assert!(matches!(summary.ending, StopReason::Doubt(Doubt::Depth(_))), "{summary:?}");
    }
}

/// At 25° off the axis the distance along the ray is 10 % longer than along the axis.
#[test]
fn the_distance_along_the_ray_is_no_depth() {
    let camera = camera_file::paper().unwrap();
    let along_ray = |intrinsics: &Intrinsics, (u, v)| intrinsics.deproject(u, v, 1.0).coords.norm();
    let mut aside = camera.clone();
    aside.pose.rotation *= nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.4);
    let summary = drive(&aside, &aside, |frame| scaled(&frame, along_ray));
    println!("{}", summary.ending);
    assert!(matches!(summary.ending, StopReason::Doubt(Doubt::Depth(_))), "{summary:?}");
    let summary = drive(&aside, &aside, |frame| frame);
    assert!(summary.reached && doubts(&summary).is_empty(), "{summary:?}");
}

/// Without depth, a ball lies at the target, and another one hangs on the cables.
#[test]
fn a_second_ball_that_lies_at_the_target_reaches_nothing() {
    let mut camera = camera_file::paper().unwrap();
    camera.intrinsics.depth_scale = 0.0;
    let (background, options) = (plain_room::background(), RenderOptions::default());
    let mut still = SyntheticCamera::new(camera.clone(), background, options, 2).unwrap();
    let target = Task::paper().target;
    let lying = still.render(0.0, &Scene { ball: Some(target), ..Scene::default() }).unwrap();
    let (u, v) = camera.intrinsics.project(&(camera.pose.inverse() * target)).unwrap();
    let with_both = |frame: RgbdFrame| {
        let mut colour = frame.colour().clone();
        let width = colour.width();
        for (i, pixel) in colour.pixels_mut().iter_mut().enumerate() {
            let place = ((i % width) as f64 - u, (i / width) as f64 - v);
            if place.0.hypot(place.1) < 25.0 {
                *pixel = lying.colour().pixels()[i];
            }
        }
        RgbdFrame::new(frame.time(), colour, frame.depth().clone(), *frame.intrinsics()).unwrap()
    };
    let summary = drive(&camera, &camera, with_both);
    println!("{}, {:?}", summary.ending, summary.filtered_error_mm);
    assert!(!summary.reached && !summary.is_done, "{summary:?}");
    assert_eq!(doubts(&summary), [Doubt::TwoBalls], "{summary:?}");
}

/// A detector whose positions are shifted after a time.
struct Knocked {
    detector: FixedDetector,
    /// First and last time of the shift, seconds.
    times: [f64; 2],
}

impl BallDetector for Knocked {
    fn name(&self) -> &'static str {
        "knocked"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let Some(ball) = self.detector.detect(frame)? else { return Ok(None) };
        let [begin, end] = self.times;
        let is_shifted = (begin..end).contains(&frame.time());
        // Towards the target: the board's guards see a ball that comes nearer.
        let shift = Vector3::z() * if is_shifted { -0.14 } else { 0.0 };
        let position = ball.position.map(|it| Gaussian3 { mean: it.mean + shift, ..it });
        Ok(Some(BallObservation { position, ..ball }))
    }
}

/// Drives the paper's task with positions that are shifted in this time, seconds. `is_known` says
/// whether the rig file has the size.
fn knocked(times: [f64; 2], is_known: bool) -> (Summary, f64) {
    let mut rig = Rig::paper().unwrap();
    if !is_known {
        (rig.size, rig.simulation) = (None, None);
    }
    let simulated = link("ideal").paper_board(7);
    let camera = camera_file::paper().unwrap();
    let mut source = TrackingCamera::new(simulated.rig(), camera.clone(), Timing::default());
    let run = Run::connect(&rig, simulated.transport()).unwrap();
    let summary = run.drive(RunParts {
        source: &mut source,
        detector: &mut Knocked { detector: FixedDetector(camera), times },
        observers: &mut [],
        operator: None,
        timeout: 30.0,
        interrupted: &AtomicBool::new(false),
    });
    let summary = summary.unwrap();
    let ball = simulated.board().borrow().ball().unwrap();
    let error = (ball - Point3::from(summary.legs[0].target_m)).norm();
    (summary, error)
}

#[test]
fn a_camera_that_is_knocked_in_a_run_ends_it() {
    for is_known in [true, false] {
        let (summary, error) = knocked([0.8, f64::INFINITY], is_known);
        println!("{}, {error:.3} m off", summary.ending);
        let StopReason::Doubt(Doubt::Jump(distance)) = summary.ending else {
            panic!("{summary:?}");
        };
        assert!((distance - 0.14).abs() < 0.02 && !summary.reached, "{summary:?}");
        assert!(summary.ending.to_string().contains("mm from one picture to the next"));
    }
}

#[test]
fn a_short_false_detection_ends_no_run() {
    // One or two pictures, which the board passes over.
    let (summary, error) = knocked([0.8, 0.86], true);
    println!("{}, {error:.3} m off", summary.ending);
    assert!(summary.reached && doubts(&summary).is_empty() && error < 0.012, "{summary:?}");
}
