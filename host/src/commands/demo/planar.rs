//! `plumb demo --planar`: two motors, both wired the wrong way, before a tilted camera whose
//! picture is mirrored. Two jogs, and the ball goes where one points.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use plumb_cameras::camera_file;
use plumb_cameras::record::Overflow;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_protocol::MotorList;
use plumb_runtime::link::Link;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::Summary;
use plumb_setup::new_rig::NewPlanarRig;
use plumb_sim::simulated::{SimulatedCamera, Timing, VirtualBoard, synthetic_camera};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;
use serde::Serialize;

use super::task::Args;
use crate::cli::exit::{Exit, Failure, failed};
use crate::cli::print;
use crate::session::camera::RunCamera;
use crate::session::goal::Goal;
use crate::session::picture::{self, Before};
use crate::session::{Session, Task};

/// Target of the demo: column and row of the mirrored picture, pixels.
const TARGET_PX: [f64; 2] = [250.0, 303.0];

/// Pixels of motors A and B in the mirrored picture.
const MOTORS_PX: [[f64; 2]; 2] = [[184.0, 69.0], [523.0, 109.0]];

/// Line of JSON: the summary, and the true error of the simulation.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    /// Distance of the simulated ball from the target at the end, pixels.
    true_error_px: f64,
    seed: u64,
    time: &'static str,
}

/// Camera whose picture is mirrored.
struct Mirrored<S>(S);

impl<S: CameraSource> CameraSource for Mirrored<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(frame) = self.0.next_frame()? else { return Ok(None) };
        let (width, height) = (frame.colour().width(), frame.colour().height());
        let rows = frame.colour().pixels().chunks(width);
        let pixels = rows.flat_map(|row| row.iter().rev().copied()).collect();
        let colour = ColourImage::new(width, height, pixels).map_err(SourceError::new)?;
        let (time, lens) = (frame.time(), *frame.intrinsics());
        let mirrored = RgbdFrame::new(time, colour, frame.depth().clone(), lens);
        let mirrored = mirrored.map_err(SourceError::new)?;
        Ok(Some(mirrored.with_ground_truth(frame.ground_truth())))
    }

    fn now(&self) -> f64 {
        self.0.now()
    }

    fn is_live(&self) -> bool {
        self.0.is_live()
    }
}

/// Returns rig and camera of the demo, with the text of the camera file.
fn rig(law: Option<&LawSettings>) -> Result<(Rig, Camera, String), Failure> {
    let new = NewPlanarRig { is_simulated: true, ..NewPlanarRig::default() };
    let files = new.files()?;
    let mut rig = Rig::parse(Path::new("rig.toml"), &files.rig)?;
    let camera = camera_file::parse(Path::new("camera.toml"), &files.camera)?;
    if let Some(law) = law {
        let mean = rig.law.mean();
        rig.law = law.clone();
        rig.law.set_mean(mean);
    }
    rig.motors.max_rate = 400.0.try_into()?;
    rig.motors.max_acceleration = 2000.0.try_into()?;
    if let Some(simulation) = &mut rig.simulation {
        simulation.reversed = Some(MotorList::from([true; 2]));
    }
    if let Some(plane) = &mut rig.plane {
        plane.set([TARGET_PX].to_vec(), Some(MOTORS_PX))?;
    }
    Ok((rig, camera, files.camera))
}

/// Runs the demo.
pub(super) fn run(args: &Args, interrupted: &AtomicBool) -> Result<Exit, Failure> {
    let (rig, model, camera_text) = rig(args.law.as_ref())?;
    let Some(simulation) = &rig.simulation else { return Err(failed("no rig is simulated")) };
    let board = VirtualBoard::new(args.physics.plant(&rig, simulation)?);
    let clock = if args.virtual_time { board.rig() } else { board.paced_rig() };
    let synthetic = synthetic_camera(simulation, &model)?;
    let eye = synthetic.camera().clone();
    let source = SimulatedCamera::new(clock, synthetic, simulation.motors(), Timing::default());
    let source = Box::new(Mirrored(source));
    let mut camera = RunCamera { is_paced: !args.virtual_time, ..RunCamera::of(source, model) };
    let mut link = Link::connect(board.transport())?;
    link.configure(rig.wiring()?, rig.config()?)?;
    let seen = (&mut camera, args.options.detector);
    let texts = (&rig, &*camera_text);
    let found = picture::measure(texts, &mut link, seen, Before::agreed(), interrupted)?;
    let task = Task {
        rig: found.rig,
        camera_text: found.camera_text,
        goal: Goal::Targets,
        output_dir: args.options.output_dir("demo"),
        overflow: if args.virtual_time { Overflow::Block } else { Overflow::Drop },
        clear: "plumb clear".to_owned(),
    };
    let mut session = Session::prepare(task, &camera.camera, &args.options)?;
    let width = 2.0 * camera.camera.intrinsics.cx;
    let run = session.connect_on(link)?;
    let ended = session.drive(run, camera, None, interrupted)?;
    let ball = board.board().borrow().ball().unwrap_or_default();
    ended.conclude(|summary| {
        let seen = eye.intrinsics.project(&eye.pose.inverse_transform_point(&ball));
        let off =
            seen.map_or(f64::NAN, |(u, v)| (width - u - TARGET_PX[0]).hypot(v - TARGET_PX[1]));
        let time = if args.virtual_time { "virtual" } else { "real" };
        let true_error_px = (off * 1e3).round() / 1e3;
        let line = Line { summary, true_error_px, seed: args.seed, time };
        Ok(print::result(&serde_json::to_string(&line)?)?)
    })
}
