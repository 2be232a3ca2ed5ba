//! The camera of a run, and the recording of its frames.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use plumb_cameras::camera_file;
use plumb_cameras::capture::{Capture, CaptureLimits};
use plumb_cameras::open::OpenedCamera;
use plumb_cameras::record::RecordFolder;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_cameras::stream::FIRST_FRAME;
use plumb_config::bounded_read::{ReadError, read_text};
use plumb_config::toml_file::MAX_BYTES;
use plumb_frame::source::CameraSource;
use plumb_runtime::rig::Rig;
use plumb_sim::simulated::{HilObserver, HilPlant, SimulatedCamera, Timing, synthetic_camera};
use plumb_vision::camera::Camera;

use super::interrupt::DefaultSignals;
use super::print::{note, tell};
use super::ros2::open_camera;
use super::{Failure, Physics, bad_input};

/// Reads the camera file of `rig` of `file`. Returns its text too.
///
/// # Errors
/// Where it cannot be read, or has a mistake.
pub(crate) fn read_camera(file: &Path, rig: &Rig) -> Result<(String, Camera), Failure> {
    let path = &rig.camera.file;
    let text = read_text(path, MAX_BYTES).map_err(|error| match &error {
        ReadError::Io { error: cause, .. } if cause.kind() == ErrorKind::NotFound => {
            bad_input(format!(
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
}

impl RunCamera {
    /// Opens the camera of `rig`, whose camera file describes `camera`. A device also records to
    /// the file `oni`.
    pub(super) fn open(rig: &Rig, camera: Camera, oni: Option<PathBuf>) -> Result<Self, Failure> {
        note!("preparing the camera");
        let signals = sender(&rig.camera).map(|sender| {
            note!("camera: waiting for {sender}, {} s at most", FIRST_FRAME.as_secs());
            // Nothing moves yet, and the sender may never come.
            DefaultSignals::begin()
        });
        let OpenedCamera { source, camera, description, notes } =
            open_camera(&rig.camera, camera, oni.as_deref())?;
        drop(signals);
        if let Some(description) = description {
            note!("camera: {description}");
        }
        for note in &notes {
            tell!("plumb: {note}");
        }
        Ok(Self { source, camera, oni, follower: None })
    }

    /// Opens a camera that renders the simulated rig, which follows the board's motors from their
    /// present positions `motors` (full steps from the zero of travel).
    pub(super) fn simulated(
        rig: &Rig,
        camera: Camera,
        physics: Physics,
        motors: [f64; 3],
    ) -> Result<Self, Failure> {
        let Some(simulation) = &rig.simulation else {
            return Err(bad_input("no rig is simulated"));
        };
        note!("preparing the simulated camera");
        let plant = HilPlant::new(physics.plant(rig, simulation)?);
        let mut follower = plant.observer();
        follower.board_stands(motors)?;
        let synthetic = synthetic_camera(simulation, &camera)?;
        let source = SimulatedCamera::new(plant, synthetic, simulation.motors(), Timing::default());
        let source = Box::new(Capture::start(source, CaptureLimits::default())?);
        Ok(Self { source, camera, oni: None, follower: Some(follower) })
    }
}

/// Returns what another program must send, for a person; `None` for other cameras.
fn sender(settings: &CameraSettings) -> Option<String> {
    match (settings.source, &settings.stream) {
        (Some(SourceName::Ros2), _) => Some(format!("pictures on {}", settings.ros2.colour)),
        (_, stream) => stream.as_ref().map(|address| format!("frames at {address}")),
    }
}

/// Creates the folder for a recording, where one is asked for.
pub(super) fn record_folder(path: Option<&Path>) -> Result<Option<RecordFolder>, Failure> {
    Ok(path.map(RecordFolder::create).transpose()?)
}
