//! What a run looks through, and what is recorded of it.

use std::path::{Path, PathBuf};

use plumb_cameras::record::RecordFolder;
use plumb_cameras::source::openni::{IntrinsicsSource, OpenNi, OpenniSource};
use plumb_cameras::source::playback::Playback;
use plumb_cameras::source::tee::Tee;
use plumb_cameras::source::{CameraSource, OpenedRecording, open_recording};
use plumb_runtime::rig::{IntrinsicsFrom, Rig, SourceName};
use plumb_sim::simulated::{Follower, FollowingWorld, SimulatedCamera, Timing};
use plumb_sim::synthetic::{Background, Options, Room, SyntheticCamera};
use plumb_vision::camera::Camera;

use super::print::tell;
use super::{Failure, OrFail, Physics};

/// A source of pictures, and the camera that they are taken with.
pub(crate) struct Sight {
    pub(crate) source: Box<dyn CameraSource>,
    /// As in its file, but for the intrinsics, where the device tells them.
    pub(crate) camera: Camera,
    /// Moves the simulated rig, where that is what the source shows.
    pub(crate) follower: Option<Follower>,
}

impl Sight {
    /// Opens the source `chosen` of `rig`, which looks as `camera` says; what comes from a device
    /// is also recorded to the file `oni`.
    pub(super) fn open(
        chosen: SourceName,
        rig: &Rig,
        camera: Camera,
        physics: Physics,
        oni: Option<PathBuf>,
    ) -> Result<Self, Failure> {
        match chosen {
            SourceName::Simulated => simulated(rig, camera, physics),
            SourceName::Openni => live(rig, camera, oni),
            SourceName::Recording => {
                let Some(path) = &rig.camera.recording else {
                    return Err("no recording is named").or_bad_input();
                };
                let OpenedRecording { source, intrinsics } =
                    open_recording(path, camera.intrinsics).or_bad_input()?;
                let camera = Camera { intrinsics, ..camera };
                Ok(Self { source: Box::new(Playback::new(source)), camera, follower: None })
            }
        }
    }
}

/// A camera that looks at the simulated rig, which follows the board's motors.
fn simulated(rig: &Rig, camera: Camera, physics: Physics) -> Result<Sight, Failure> {
    let Some(simulation) = &rig.simulation else {
        return Err("no rig is simulated").or_bad_input();
    };
    let motors = simulation.motors();
    let world = FollowingWorld::new(physics.plant(simulation).or_bad_input()?);
    let follower = Some(world.follower());
    let background = Background::Room(Room::furnished());
    let synthetic =
        SyntheticCamera::new(camera.clone(), background, Options::default(), 1).or_bad_input()?;
    let source = Box::new(SimulatedCamera::new(world, synthetic, motors, Timing::default()));
    Ok(Sight { source, camera, follower })
}

/// A camera through OpenNI2.
fn live(rig: &Rig, camera: Camera, oni: Option<PathBuf>) -> Result<Sight, Failure> {
    let choice = &rig.camera.openni;
    let lens = match choice.intrinsics {
        IntrinsicsFrom::File => IntrinsicsSource::Calibrated(camera.intrinsics),
        IntrinsicsFrom::Device => IntrinsicsSource::FieldOfView,
    };
    let openni = OpenNi::load().or_bad_input()?;
    let (target, settings) = choice.settings(oni);
    let source = OpenniSource::open(&openni, &target, settings, lens).or_bad_input()?;
    let opened = source.opened();
    tell!("camera: {} ({}), {}", opened.name, opened.uri, opened.mode);
    for note in &opened.notes {
        tell!("plumb: {note}");
    }
    let camera = Camera { intrinsics: *source.intrinsics(), ..camera };
    Ok(Sight { source: Box::new(source), camera, follower: None })
}

/// The folder for a recording, where one is asked for.
pub(super) fn record_folder(path: Option<&Path>) -> Result<Option<RecordFolder>, Failure> {
    path.map(RecordFolder::create).transpose().or_bad_input()
}

/// Ends the recording, closes the source, and tells what was recorded.
pub(super) fn recorded<S>(source: Tee<S>) -> Result<(), Failure> {
    let (source, recording) = source.finish();
    drop(source);
    if let Some(recording) = recording.or_failed()? {
        let left_out = match recording.left_out {
            0 => String::new(),
            n => format!(", {n} left out: they came faster than they could be written"),
        };
        tell!("recorded: {} frames in {}{left_out}", recording.frames, recording.folder.display());
    }
    Ok(())
}
