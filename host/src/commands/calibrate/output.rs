//! Files of a calibration: the camera file, its former version, the picture.

use std::fs;
use std::io::{BufRead, IsTerminal, Write, stdin};
use std::path::{Path, PathBuf};

use plumb_calibrate::camera_text::with_pose;
use plumb_cameras::camera_file;
use plumb_vision::image::ColourImage;

use super::Found;
use crate::commands::print::{message, tell};
use crate::commands::{Failure, bad_input, failed};

/// The rig's camera file.
pub(super) struct CameraFile<'a> {
    pub(super) path: &'a Path,
    /// Its text.
    pub(super) text: &'a str,
}

impl CameraFile<'_> {
    /// Writes the picture beside the camera file. Returns its path.
    pub(super) fn keep_picture(&self, picture: &ColourImage) -> Result<PathBuf, Failure> {
        let path = beside(self.path, "calibration");
        plumb_cameras::png::save(&path, picture)?;
        Ok(path)
    }

    /// Writes the pose into the camera file, if the user agrees. Returns whether it is written.
    pub(super) fn offer(&self, found: &Found, is_agreed: bool) -> Result<bool, Failure> {
        let comment = format!("plumb calibrate --{}", found.way.option());
        let text = with_pose(self.text, &found.calibration.pose, &comment)?;
        camera_file::parse(self.path, &text)?;
        if !(is_agreed || self.ask()?) {
            tell!("{} is not changed", self.path.display());
            return Ok(false);
        }
        let backup = self.backup();
        write(&backup, self.text.as_bytes())?;
        replace(self.path, text.as_bytes())?;
        tell!("{} is written; the former one is {}", self.path.display(), backup.display());
        Ok(true)
    }

    /// Returns the path of the former version: "camera.toml.bak".
    fn backup(&self) -> PathBuf {
        let mut name = self.path.as_os_str().to_owned();
        name.push(".bak");
        name.into()
    }

    fn ask(&self) -> Result<bool, Failure> {
        if !stdin().is_terminal() {
            tell!("plumb: nobody can be asked on this input: write the pose with --yes");
            return Ok(false);
        }
        message(format_args!("Write the pose into {}? [y/N] ", self.path.display()));
        let mut line = String::new();
        stdin().lock().read_line(&mut line)?;
        Ok(matches!(line.trim(), "y" | "Y" | "yes"))
    }
}

/// Returns the path of a picture beside the camera file: "camera.NAME.png".
pub(super) fn beside(camera_file: &Path, name: &str) -> PathBuf {
    camera_file.with_extension(format!("{name}.png"))
}

/// Writes a file that does not exist yet.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut file = fs::File::create_new(path)
        .map_err(|error| bad_input(format!("{}: cannot be created: {error}", path.display())))?;
    file.write_all(bytes).map_err(|error| failed(format!("{}: {error}", path.display())))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let message = |error| failed(format!("{}: cannot be written: {error}", path.display()));
    fs::write(path, bytes).map_err(message)
}

/// Replaces a file in one step, so that no reader sees half of it.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    // A link is followed: the file that it names is replaced.
    let message = |error| failed(format!("{}: cannot be written: {error}", path.display()));
    let path = fs::canonicalize(path).map_err(message)?;
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let new = PathBuf::from(name);
    write(&new, bytes)?;
    fs::rename(&new, &path).map_err(message)
}
