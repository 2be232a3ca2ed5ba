//! Result of a calibration, and its files: the camera file and the picture.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use plumb_calibrate::calibration::Calibration;
use plumb_calibrate::camera_text::with_pose;
use plumb_calibrate::overlay::draw;
use plumb_cameras::camera_file;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::MAX_BYTES;
use plumb_runtime::rig::Rig;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;
use serde::Serialize;

use super::report::Way;
use crate::cli::exit::{Exit, Failure};
use crate::cli::old_file::OldFile;
use crate::cli::print;

/// The rig's camera file.
pub(super) struct CameraFile {
    pub(super) path: PathBuf,
    /// Its text.
    pub(super) text: String,
}

impl CameraFile {
    /// Writes the picture beside the camera file. Returns its path.
    pub(super) fn keep_picture(&self, picture: &ColourImage) -> Result<PathBuf, Failure> {
        let path = beside(&self.path, "calibration");
        plumb_cameras::png::save(&path, picture)?;
        Ok(path)
    }

    /// Writes the pose into the camera file, if the user agrees. Returns whether it is written.
    pub(super) fn offer(&self, found: &Found, is_agreed: bool) -> Result<bool, Failure> {
        let comment = format!("plumb calibrate --{}", found.way.option());
        let text = with_pose(&self.text, &found.calibration.pose, &comment)?;
        camera_file::parse(&self.path, &text)?;
        self.replace(&text, "the pose", is_agreed)
    }

    /// Replaces the file by `text`, if the user agrees: writes `what` into it. Returns whether it
    /// is written.
    pub(super) fn replace(&self, text: &str, what: &str, is_agreed: bool) -> Result<bool, Failure> {
        OldFile { path: &self.path, text: &self.text }.offer(text, what, is_agreed)
    }
}

/// Returns what to write in the rig file `file` so that a run takes the lens of its camera file;
/// `None` where it does.
pub(super) fn without_effect(file: &Path, rig: &Rig) -> Option<String> {
    let source = rig.camera.source(rig.simulation.is_some()).ok()?;
    rig.camera.has_intrinsics_of_device(source).then(|| {
        let text = read_text(file, MAX_BYTES).unwrap_or_default();
        // A second table of the device would be a mistake, and so would a second key.
        let has_table = [format!("[camera.{source}]"), format!("{source}.")];
        let change = match has_table.iter().any(|it| text.contains(it.as_str())) {
            true => format!("set `intrinsics = \"file\"` in [camera.{source}]"),
            false => format!("write `{source}.intrinsics = \"file\"` below [camera]"),
        };
        let ignored = "a run ignores the lens of the camera file, and takes that of the device";
        format!("{ignored}: {change} of {}", file.display())
    })
}

/// Ends a calibration whose file was offered to the user: prints the line of JSON of `report`,
/// which gets whether the file is `written`, where it is asked for.
///
/// # Errors
/// Where the file could not be written, or nobody could be asked.
pub(super) fn conclude<R: Serialize>(
    written: Result<bool, Failure>,
    is_json: bool,
    report: impl FnOnce(bool) -> R,
) -> Result<Exit, Failure> {
    print::json(is_json, report(matches!(written, Ok(true))))?;
    match written {
        Ok(true) => Ok(Exit::Done),
        Ok(false) => Ok(Exit::Failed),
        Err(failure) if is_json => Err(failure.with_result()),
        Err(failure) => Err(failure),
    }
}

/// Returns the path of a picture beside the camera file: "camera.NAME.png".
pub(super) fn beside(camera_file: &Path, name: &str) -> PathBuf {
    camera_file.with_extension(format!("{name}.png"))
}

/// Result of one of the ways, with the last picture.
pub(super) struct Found {
    pub(super) way: Way,
    pub(super) calibration: Calibration,
    pub(super) frame: RgbdFrame,
    /// Closed line to draw, rig frame, metres.
    pub(super) outline: Vec<Point3<f64>>,
}

impl Found {
    pub(super) fn draw(&self) -> Result<ColourImage, Failure> {
        let (frame, outline) = (&self.frame, &self.outline);
        let (colour, intrinsics) = (frame.colour(), frame.intrinsics());
        Ok(draw(colour, intrinsics, &self.calibration, outline)?)
    }
}
