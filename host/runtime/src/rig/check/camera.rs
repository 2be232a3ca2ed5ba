//! Check of the table `[camera]` of a rig file, and of the camera file that it names.

use std::path::{Path, PathBuf};

use plumb_cameras::camera_file;
use plumb_cameras::recording::{OtherDepthScale, check_kind};
use plumb_cameras::settings::CameraSettings;
use plumb_config::bounded_read::read_text;
use plumb_config::error_chain::ErrorChain;
use plumb_config::toml_file::MAX_BYTES;
use plumb_frame::camera::{CalibratedFor, Camera};
use plumb_frame::image::ImageSize;

use crate::rig::Rig;
use crate::rig::document::{Document, Finding, Severity};

/// Returns the error of the table `[camera]`, or the warning about it.
pub(super) fn source(
    document: &Document<'_>,
    settings: &CameraSettings,
    simulation: bool,
) -> Option<Finding> {
    if let Err(error) = settings.source(simulation) {
        let keys = ["camera.source", "camera.recording"];
        let key = if settings.source.is_some() { &keys[..1] } else { &keys[1..] };
        return Some(document.finding(Severity::Error, key, format!("is wrong: {error}")));
    }
    let recording: &PathBuf = settings.recording.as_ref()?;
    let problem = match check_kind(recording) {
        _ if !recording.exists() => {
            format!("names no file: {} does not exist", recording.display())
        }
        Ok(()) => return None,
        Err(error) => format!("names no recording: {}", ErrorChain(&error)),
    };
    Some(document.finding(Severity::Error, &["camera.recording"], problem))
}

/// Returns the errors of the camera file at `path`, which the rig file `rig` names.
pub(super) fn file(path: &Path, rig: &Document<'_>) -> Vec<Finding> {
    let wrong = |problem| vec![rig.finding(Severity::Error, &["camera.file"], problem)];
    let text = match read_text(path, MAX_BYTES) {
        Ok(text) => text,
        Err(error) => return wrong(format!("is wrong: {}", ErrorChain(&error))),
    };
    if camera_file::is_rig_file(&text) {
        return wrong(format!("is wrong: {} is a rig file; give the camera file", path.display()));
    }
    let document = Document::new(path, &text, camera_file::REFERENCE);
    document.mistakes(&camera_file::mistakes(&text))
}

/// Returns the warnings about a camera file for other pictures than those of `rig`: their units of
/// depth, and their size.
pub(super) fn other_pictures(
    document: &Document<'_>,
    rig: &Rig,
    camera: &Camera,
) -> impl Iterator<Item = Finding> {
    let depth = other_depth_scale(document, rig, camera);
    depth.into_iter().chain(other_size(document, rig, camera))
}

/// Returns the warning about other units of depth in the camera file than those of the recording.
fn other_depth_scale(document: &Document<'_>, rig: &Rig, camera: &Camera) -> Option<Finding> {
    let other = OtherDepthScale::of(rig.camera.recording.as_ref()?, camera)?;
    let problem = format!("is written here, but {other}");
    Some(document.finding(Severity::Warning, &["intrinsics.depth_scale"], problem))
}

/// Returns the warning about intrinsics for pictures of another size than the camera is asked for.
fn other_size(document: &Document<'_>, rig: &Rig, camera: &Camera) -> Option<Finding> {
    let source = rig.camera.source(rig.simulation.is_some()).ok()?;
    let CalibratedFor::Size(ImageSize { width, height }) = camera.calibrated_for else {
        return None;
    };
    let asked = rig.camera.asked_size(source)?;
    let is_same = asked.map(usize::from) == [width, height];
    (!is_same && !rig.camera.has_intrinsics_of_device(source)).then(|| {
        let problem = format!(
            "are the size of other pictures than the {} x {} of camera.{source} in the rig file: a \
             run refuses those. `plumb calibrate --lens` finds the lens anew",
            asked[0], asked[1]
        );
        document.finding(Severity::Warning, &["intrinsics.width", "intrinsics.height"], problem)
    })
}
