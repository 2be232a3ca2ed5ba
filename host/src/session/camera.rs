//! The camera of a run, and the recording of its frames.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use plumb_cameras::camera_file;
use plumb_cameras::capture::{Capture, CaptureLimits};
use plumb_cameras::open::OpenedCamera;
use plumb_cameras::recording::OtherDepthScale;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_cameras::stream::FIRST_FRAME;
use plumb_config::bounded_read::{ReadError, read_text};
use plumb_config::toml_file::MAX_BYTES;
use plumb_frame::source::CameraSource;
use plumb_protocol::MotorList;
use plumb_runtime::rig::{MotionError, Rig};
use plumb_sim::led_port::LedPort;
use plumb_sim::simulated::{HilObserver, HilPlant, SimulatedCamera, Timing, synthetic_camera};
use plumb_vision::camera::Camera;

use crate::cli::choices::Physics;
use crate::cli::exit::{Failure, failed};
use crate::cli::interrupt::DefaultSignals;
use crate::session::connection::RigBoard;
use crate::session::ros2::open_camera;

/// Reads the camera file of `rig` of `file`. Returns its text too.
///
/// # Errors
/// Where it cannot be read, or has a mistake.
pub(crate) fn read_camera(file: &Path, rig: &Rig) -> Result<(String, Camera), Failure> {
    let path = &rig.camera.file;
    let text = read_text(path, MAX_BYTES).map_err(|error| match &error {
        ReadError::Io { error: cause, .. } if cause.kind() == ErrorKind::NotFound => {
            failed(format!(
                "{}: there is no such file; `camera.file` of {} names it",
                path.display(),
                file.display()
            ))
        }
        _ => error.into(),
    })?;
    let camera = camera_file::parse(path, &text)?;
    Ok((text, camera))
}

/// Returns a warning where `camera`, of the camera file `file`, has other units of depth than the
/// own camera file of `recording`.
pub(crate) fn other_depth_scale(recording: &Path, file: &Path, camera: &Camera) -> Option<String> {
    let other = OtherDepthScale::of(recording, camera)?;
    let given = camera.intrinsics.depth_scale;
    Some(format!("{}: depth_scale = {given}, but {other}", file.display()))
}

/// Returns the source of the frames that `rig` of `file` chooses.
pub(crate) fn chosen_source(file: &Path, rig: &Rig) -> Result<SourceName, Failure> {
    let chosen = rig.camera.source(rig.simulation.is_some());
    chosen.map_err(|error| failed(format!("{}: {error}", file.display())))
}

/// Open camera of a run.
pub(crate) struct RunCamera {
    /// Source of the frames.
    pub(crate) source: Box<dyn CameraSource>,
    /// The camera file, with the intrinsics of the frames.
    pub(crate) camera: Camera,
    /// The device's own recording, where it makes one.
    pub(crate) oni: Option<PathBuf>,
    /// Moves the simulated rig, where the source renders one.
    pub(crate) follower: Option<HilObserver>,
    /// Whether its time goes slower where the computer is late.
    pub(crate) is_paced: bool,
}

/// Rig that a simulated camera shows.
pub(crate) struct SimulatedRig {
    pub(crate) physics: Physics,
    /// Present positions of the board's motors, full steps from the zero of travel.
    pub(crate) motors: MotorList<f64>,
    /// Port of an emulated board that waits for this program.
    pub(crate) led: Option<LedPort>,
}

impl RunCamera {
    /// Returns the open camera that delivers the frames of `source`.
    pub(crate) fn of(source: Box<dyn CameraSource>, camera: Camera) -> Self {
        Self { source, camera, oni: None, follower: None, is_paced: false }
    }

    /// Opens the camera of the rig of `board`, which may be `simulated`. A device also records to
    /// the file `oni`.
    pub(crate) fn open_beside_board(
        board: RigBoard<'_>,
        camera: Camera,
        oni: Option<PathBuf>,
        simulated: SimulatedRig,
    ) -> Result<Self, Failure> {
        if chosen_source(board.file, board.rig)? == SourceName::Simulated {
            return Self::simulated(board.rig, camera, simulated);
        }
        Self::open(board.rig, camera, oni, board.without_simulation().as_deref())
    }

    /// Opens the camera of `rig`, whose camera file describes `camera`. A device also records to
    /// the file `oni`. The advice `without_simulation` is told before another program is waited
    /// for, and where the camera cannot be opened.
    pub(crate) fn open(
        rig: &Rig,
        camera: Camera,
        oni: Option<PathBuf>,
        without_simulation: Option<&str>,
    ) -> Result<Self, Failure> {
        note!("preparing the camera");
        let recording = rig.camera.recording.as_deref();
        let other = recording.and_then(|it| other_depth_scale(it, &rig.camera.file, &camera));
        if let Some(warning) = other {
            tell!("plumb: warning: {warning}");
        }
        if recording.is_some() {
            note!("the pictures are a recording: its ball does not follow the motors");
        }
        let signals = sender(&rig.camera).map(|sender| {
            note!("camera: waiting for {sender}, {} s at most", FIRST_FRAME.as_secs());
            if let Some(advice) = without_simulation {
                note!("{advice}");
            }
            // Nothing moves yet, and the sender may never come.
            DefaultSignals::begin()
        });
        let OpenedCamera { source, camera, description, notes } =
            open_camera(&rig.camera, camera, oni.as_deref()).map_err(|failure| {
                match without_simulation {
                    Some(advice) => failure.with_advice(advice),
                    None => failure,
                }
            })?;
        drop(signals);
        if let Some(description) = description {
            note!("camera: {description}");
        }
        for note in &notes {
            tell!("plumb: {note}");
        }
        Ok(Self { oni, ..Self::of(source, camera) })
    }

    /// Opens a camera that renders the simulated rig, which follows the board's motors from their
    /// present positions.
    fn simulated(rig: &Rig, camera: Camera, simulated: SimulatedRig) -> Result<Self, Failure> {
        let SimulatedRig { physics, motors, led } = simulated;
        let Some(simulation) = &rig.simulation else {
            return Err(failed("no rig is simulated"));
        };
        note!("preparing the simulated camera");
        let is_paced = led.is_some();
        let plant = HilPlant::new(physics.plant(rig, simulation)?, led);
        let mut follower = plant.observer();
        follower.board_stands(motors.steppable(0.0))?;
        let synthetic = synthetic_camera(simulation, &camera)?;
        let source = SimulatedCamera::new(plant, synthetic, simulation.motors(), Timing::default());
        let source: Box<dyn CameraSource> = match is_paced {
            true => Box::new(source),
            false => Box::new(Capture::start(source, CaptureLimits::default())?),
        };
        Ok(Self { follower: Some(follower), is_paced, ..Self::of(source, camera) })
    }

    /// Checks that the ball of the simulated `rig`, where this is one, hangs inside the workspace
    /// with the board's motors at `motors` (full steps from the zero of travel).
    pub(crate) fn check_ball(&self, rig: &Rig, motors: &[f64]) -> Result<(), Failure> {
        let Some(follower) = &self.follower else { return Ok(()) };
        let checked = rig.motion_rules().check(follower.ball(), Vector3::zeros());
        let Err(MotionError::Workspace(outside)) = checked else { return Ok(()) };
        let motors: Vec<_> = motors.iter().map(|at| format!("{at:.0}")).collect();
        Err(failed(format!(
            "the board's motors stand at {} full steps: there the ball of this simulated rig is \
             outside its workspace, {outside}",
            motors.join(", ")
        ))
        .with_advice(
            "A board keeps its motors' positions from one run to the next, also those of another \
             rig. `plumb home` puts the ball of a simulated rig back at its start",
        ))
    }
}

/// Returns what another program must send, for a person; `None` for other cameras.
fn sender(settings: &CameraSettings) -> Option<String> {
    match (settings.source, &settings.stream) {
        (Some(SourceName::Ros2), _) => Some(format!("pictures on {}", settings.ros2.colour)),
        (_, stream) => stream.as_ref().map(|address| format!("frames at {address}")),
    }
}
