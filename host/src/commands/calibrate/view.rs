//! Pictures for a calibration: from the rig's camera, or rendered where the rig is simulated.
//!
//! On a simulated rig nobody can lay a board or hold the ball. Its pictures show what the user is
//! asked to do: the board at its stated place, the ball at each place.

use std::path::Path;

use nalgebra::Point3;
use plumb_calibrate::board::{CharucoSheet, Placement};
use plumb_calibrate::render::{draw_board, shown_pose};
use plumb_cameras::settings::SourceName;
use plumb_cameras::stream::StreamAddress;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::driver::OpenedSource;
use plumb_frame::source::CameraSource;
use plumb_protocol::MotorList;
use plumb_runtime::rig::{Rig, Simulation};
use plumb_sim::simulated::synthetic_camera;
use plumb_sim::synthetic::{ExtraBall, Material, Scene, SyntheticCamera};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;

use crate::cli::exit::{Failure, failed};
use crate::cli::print::tell_above;
use crate::session::camera::{RunCamera, chosen_source};
use crate::session::ros2::open_recording;

/// Pictures that a live camera took before it was asked; they are left out.
const STALE: usize = 2;
/// Lost pictures in a row after which the camera is given up.
const MAX_LOST: usize = 30;
/// Diameter of the simulated motors, metres.
const MOTOR_DIAMETER_M: f64 = 0.02;

/// What a picture shows.
pub(super) enum Stage {
    /// The board at its place.
    Board { board: CharucoSheet, placement: Placement },
    /// The motors.
    Motors,
    /// The board as it is shown for the calibration of the lens.
    Lens { number: u32 },
    /// The ball with its centre at a place in the rig frame, metres.
    Ball(Point3<f64>),
}

/// Camera of a calibration.
pub(super) struct View {
    source: Source,
    camera: Camera,
    /// Number of pictures of each stage.
    frames: usize,
}

enum Source {
    Camera(Box<dyn CameraSource>),
    Simulated(Box<SimulatedView>),
}

/// Renderer of a simulated rig.
struct SimulatedView {
    synthetic: SyntheticCamera,
    /// Camera with its true pose.
    camera: Camera,
    motors: MotorList<Point3<f64>>,
    start: Point3<f64>,
    number: u32,
}

impl View {
    /// Returns whether the pictures are rendered.
    pub(super) fn is_simulated(&self) -> bool {
        matches!(self.source, Source::Simulated(_))
    }

    /// Opens the camera as [`open`](Self::open), for one picture of each stage. Every picture of a
    /// recording is read, however long the search in one takes.
    pub(super) fn open_whole(file: &Path, rig: &Rig, camera: Camera) -> Result<Self, Failure> {
        let (SourceName::Recording, Some(path)) =
            (chosen_source(file, rig)?, &rig.camera.recording)
        else {
            return Self::open(file, rig, camera, 1);
        };
        let topics = &rig.camera.ros2;
        let OpenedSource { source, intrinsics, .. } = open_recording(path, &camera, topics)?;
        let camera = Camera { intrinsics, ..camera };
        Ok(Self { source: Source::Camera(source), camera, frames: 1 })
    }

    /// Opens the camera of the rig file `file`, whose camera file describes `camera`.
    pub(super) fn open(
        file: &Path,
        rig: &Rig,
        camera: Camera,
        frames: usize,
    ) -> Result<Self, Failure> {
        let chosen = chosen_source(file, rig)?;
        if let (SourceName::Simulated, Some(simulation)) = (chosen, &rig.simulation) {
            let source = SimulatedView::new(simulation, &camera)?;
            return Ok(Self { source: Source::Simulated(Box::new(source)), camera, frames });
        }
        if rig.camera.stream == Some(StreamAddress::StandardInput) {
            return Err(failed(format!(
                "{}: `plumb calibrate` reads answers from the standard input, so the camera cannot \
                 be there: use `stream = \"unix:camera.sock\"`",
                file.display()
            )));
        }
        let RunCamera { source, camera, .. } = RunCamera::open(rig, camera, None, None)?;
        Ok(Self { source: Source::Camera(source), camera, frames })
    }

    /// Returns the camera file's contents, with the intrinsics of the pictures.
    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns whether a person has to arrange what the pictures show.
    pub(super) fn needs_person(&self) -> bool {
        matches!(self.source, Source::Camera(_))
    }

    /// Returns the number of pictures of each stage.
    pub(super) fn count(&self) -> usize {
        self.frames
    }

    /// Takes the next picture of `stage`; `None` at the end of a recording.
    pub(super) fn next_picture(&mut self, stage: &Stage) -> Result<Option<RgbdFrame>, Failure> {
        match &mut self.source {
            Source::Camera(source) => next_picture(&mut **source),
            Source::Simulated(view) => view.frame(stage).map(Some),
        }
    }

    /// Takes pictures of `stage`.
    pub(super) fn frames(&mut self, stage: &Stage) -> Result<Vec<RgbdFrame>, Failure> {
        match &mut self.source {
            Source::Camera(source) => capture(&mut **source, self.frames),
            Source::Simulated(view) => (0..self.frames).map(|_| view.frame(stage)).collect(),
        }
    }
}

/// Takes the next picture; `None` at the end of a recording. Lost pictures are told of and left
/// out.
fn next_picture(source: &mut dyn CameraSource) -> Result<Option<RgbdFrame>, Failure> {
    let mut lost = 0;
    loop {
        match source.next_frame() {
            Ok(frame) => return Ok(frame),
            Err(error) if error.is_over() || lost >= MAX_LOST => {
                return Err(error.into());
            }
            Err(error) => {
                tell_above(format_args!("plumb: {}", ErrorChain(&error)));
                lost += 1;
            }
        }
    }
}

/// Takes `wanted` pictures. The end of a recording after at least one is no error.
fn capture(source: &mut dyn CameraSource, wanted: usize) -> Result<Vec<RgbdFrame>, Failure> {
    let stale = if source.is_live() { STALE } else { 0 };
    let mut frames = Vec::new();
    while frames.len() < stale + wanted {
        let Some(frame) = next_picture(source)? else { break };
        frames.push(frame);
    }
    frames.drain(..stale.min(frames.len()));
    if frames.is_empty() {
        return Err(failed("the recording is over: it has too few pictures for the calibration"));
    }
    Ok(frames)
}

/// Returns the last of at least one picture.
pub(super) fn last(frames: Vec<RgbdFrame>) -> Result<RgbdFrame, Failure> {
    frames.into_iter().last().ok_or_else(|| failed("the camera delivered no picture"))
}

impl SimulatedView {
    fn new(simulation: &Simulation, camera: &Camera) -> Result<Self, Failure> {
        note!("preparing the simulated camera");
        let synthetic = synthetic_camera(simulation, camera)?;
        let camera = synthetic.camera().clone();
        let (motors, start) = (simulation.motors(), simulation.start());
        Ok(Self { synthetic, camera, motors, start, number: 0 })
    }

    /// Renders a picture of `stage`.
    fn frame(&mut self, stage: &Stage) -> Result<RgbdFrame, Failure> {
        self.number += 1;
        let time = f64::from(self.number) / 30.0;
        let ball = if let Stage::Ball(place) = stage { *place } else { self.start };
        let mut scene = Scene::rig(ball, self.motors).with_ball_hue(self.camera.ball_hue);
        if let Stage::Motors = stage {
            let material = Material::from_srgb(90, 90, 95).matt();
            let motor = |centre| ExtraBall { centre, diameter: MOTOR_DIAMETER_M, material };
            scene.others = self.motors.map(motor).to_vec();
        }
        let frame = self.synthetic.render(time, &scene)?;
        let (board, pose) = match stage {
            Stage::Board { board, placement } => {
                (*board, self.camera.pose.inverse() * placement.pose())
            }
            Stage::Lens { number } => {
                let (lens, size) = (frame.intrinsics(), frame.colour().size());
                (CharucoSheet::SHEET, shown_pose(lens, size, &CharucoSheet::SHEET, *number))
            }
            Stage::Motors | Stage::Ball(_) => return Ok(frame),
        };
        let (mut colour, mut depth) = (frame.colour().clone(), frame.depth().clone());
        draw_board((&mut colour, &mut depth), frame.intrinsics(), &board, &pose);
        Ok(RgbdFrame::new(time, colour, depth, *frame.intrinsics())?)
    }
}
