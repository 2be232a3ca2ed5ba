//! The paper's task in virtual time, in a room with plain walls, seen by any camera.

use std::sync::atomic::AtomicBool;

use nalgebra::Point3;
use plumb_emulator::plant::Geometry;
use plumb_runtime::rig::{LawName, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_sim::simulated::{SimulatedCamera, Timing, VirtualBoard};
use plumb_sim::synthetic::{Background, Material, RenderOptions, Room, SyntheticCamera};
use plumb_vision::camera::Camera;
use plumb_vision::detect::DetectorKind;

/// End of a run.
#[derive(Debug)]
pub struct RunEnd {
    /// Whether the run ended with the ball at its target, by the camera.
    pub reached: bool,
    /// Distance of the ball from its target, metres.
    pub true_error: f64,
    /// Time until the target is reached, seconds.
    pub seconds: f64,
}

/// Returns a room with plain walls.
pub fn background() -> Background {
    Background::Room(Room::bare(Material::from_srgb(140, 150, 120)))
}

/// Runs the paper's task with `camera` in virtual time; `seed` is that of its noise.
pub fn drive(camera: &Camera, law: LawName, seed: u64) -> RunEnd {
    let rig = Rig { law: law.into(), ..Rig::paper().expect("the paper's rig file") };
    let board = VirtualBoard::paper().expect("the paper's rig");
    let synthetic =
        SyntheticCamera::new(camera.clone(), background(), RenderOptions::default(), seed)
            .expect("a synthetic camera");
    let motors = *Geometry::paper().motors();
    let mut source = SimulatedCamera::new(board.rig(), synthetic, motors, Timing::default());
    let run = Run::connect(&rig, board.transport()).expect("a configured board");
    let summary = run
        .drive(RunParts {
            source: &mut source,
            detector: &mut *DetectorKind::Ball.build(camera),
            observers: &mut [],
            operator: None,
            timeout: 60.0,
            interrupted: &AtomicBool::new(false),
        })
        .expect("an unbroken run");
    let target = Point3::from(summary.legs[0].target_m);
    let ball = board.board().borrow().ball().expect("a simulated ball");
    let true_error = (ball - target).norm();
    RunEnd { reached: summary.reached, true_error, seconds: summary.time_s }
}
