//! Opening a recording of any format.

use std::fmt;
use std::path::{Path, PathBuf};

use plumb_config::bounded_read::ReadError;
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, OpenedSource};
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::source::BoxedError;
use plumb_openni::{IntrinsicsSource, OpenNi, OpenniSourceError, Settings, Target, is_recording};
use plumb_realsense::{RealSense, RealsenseSourceError};
use plumb_webcam::VIDEO_ENDINGS;
use thiserror::Error;

use crate::camera_file::{self, NO_DEPTH};
use crate::playback::Playback;
use crate::record::CAMERA_FILE;
use crate::tum::{TumError, TumFolder, check_lists};

/// Driver that plays the recording at a path at the speed at which it was recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RecordingDriver<'a>(pub(crate) &'a Path);

impl CameraDriver for RecordingDriver<'_> {
    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        Ok(played(open_recording(self.0, camera)?))
    }
}

/// Failure to open a recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenRecordingError {
    /// Nothing is at the path.
    #[error("{}: there is no such recording", .0.display())]
    Absent(PathBuf),
    /// It cannot be known whether anything is at the path.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A TUM folder cannot be opened.
    #[error(transparent)]
    Tum(#[from] TumError),
    /// An `.oni` file cannot be opened.
    #[error(transparent)]
    Openni(#[from] OpenniSourceError),
    /// A `.bag` or `.db3` file cannot be opened.
    #[error(transparent)]
    Realsense(#[from] RealsenseSourceError),
    /// A `.bag` or `.db3` file of another program than librealsense2.
    #[error(
        "{}: librealsense2 does not play it. Is it a bag of ROS? Write it anew as MCAP (`ros2 bag \
         convert`, or `mcap convert`), or play it with `ros2 bag play` to a rig with \
         `source = \"ros2\"`",
        .path.display()
    )]
    Bag {
        /// The file.
        path: PathBuf,
        /// What librealsense2 says.
        source: RealsenseSourceError,
    },
    /// The file is no recording that Plumb reads.
    #[error("{}: {advice}", .path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
        /// What the file is, and the way that works.
        advice: &'static str,
    },
    /// A video file cannot be opened.
    #[cfg(feature = "videoio")]
    #[error(transparent)]
    Video(#[from] plumb_webcam::VideoFileError),
    /// The program is built without video files.
    #[cfg(not(feature = "videoio"))]
    #[error("{}", .path.display())]
    NoVideo {
        /// The video file.
        path: PathBuf,
        /// What to do.
        source: plumb_webcam::NotBuilt,
    },
}

/// Opens the recording at `path`, to be read as fast as the caller takes frames: a `.bag` or `.db3`
/// file of librealsense2, a video file, an `.oni` file of OpenNI2, or a TUM folder. `intrinsics`
/// are those of the camera file; an `.oni` file states its depth scale itself, a file of
/// librealsense2 its intrinsics too. A video file has no depth.
///
/// # Errors
/// As [`check_exists`], [`TumFolder::open`], [`plumb_openni::open_source`] and
/// [`plumb_realsense::open_source`]; where `path` is a file and its library cannot be loaded; where
/// it is a video file and the program is built without them; where it is a file of another kind.
pub fn open_recording(
    path: &Path,
    intrinsics: impl Into<FileIntrinsics>,
) -> Result<OpenedSource, OpenRecordingError> {
    check_exists(path)?;
    let intrinsics = intrinsics.into();
    if !path.is_file() {
        let source = TumFolder::open(path, intrinsics)?;
        let intrinsics = *source.intrinsics();
        return Ok(OpenedSource::new(source, intrinsics));
    }
    match FileKind::of(path) {
        FileKind::Realsense => return open_realsense(path),
        FileKind::Video => return open_video(path, intrinsics),
        FileKind::Openni => {}
        FileKind::Other(advice) => return Err(unknown(path, advice)),
    }
    let openni = OpenNi::load().map_err(OpenniSourceError::from)?;
    let target = Target::Recording(path.to_owned());
    let intrinsics = IntrinsicsSource::Calibrated(intrinsics);
    let source = plumb_openni::open_source(&openni, &target, Settings::default(), intrinsics)?;
    let intrinsics = source.intrinsics;
    Ok(OpenedSource::new(source, intrinsics))
}

/// Checks that there is a file or a folder at `path`.
///
/// # Errors
/// Where there is none, or a folder above it may not be looked into.
pub fn check_exists(path: &Path) -> Result<(), OpenRecordingError> {
    match path.try_exists() {
        Ok(true) => Ok(()),
        Ok(false) => Err(OpenRecordingError::Absent(path.to_owned())),
        Err(error) => Err(ReadError::Io { path: path.to_owned(), error }.into()),
    }
}

/// Returns the path of the camera file of a recording: the one in its folder, which may not exist.
pub fn own_camera_file(recording: &Path) -> PathBuf {
    let folder = if recording.is_file() { recording.parent() } else { Some(recording) };
    folder.unwrap_or(recording).join(CAMERA_FILE)
}

/// Returns the camera of the [own camera file](own_camera_file) of a recording; `None` where there
/// is no such file, or it has a mistake.
pub fn own_camera(recording: &Path) -> Option<Camera> {
    camera_file::read(&own_camera_file(recording)).ok()
}

/// Other units of depth than those of the camera file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherDepthScale {
    /// Depth units in a metre of the recording; 0 where it has no depth.
    recorded: f64,
}

impl OtherDepthScale {
    /// Returns the units of depth of a recording, by its own camera file, where `camera` has
    /// others; `None` where they are the same, or not known.
    pub fn of(recording: &Path, camera: &Camera) -> Option<Self> {
        let recorded = own_camera(recording)?.intrinsics.depth_scale;
        let is_other = camera.intrinsics.has_depth() && recorded != camera.intrinsics.depth_scale;
        is_other.then_some(Self { recorded })
    }
}

impl fmt::Display for OtherDepthScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the file of the recording has ")?;
        match self.recorded {
            0.0 => write!(f, "\"{NO_DEPTH}\"")?,
            recorded => write!(f, "{recorded}")?,
        }
        f.write_str(": no ball is found where the depth is wrong")
    }
}

/// Checks that a folder has a list of pictures, and that a file is of a kind that is a recording.
///
/// # Errors
/// Where it is not, with the way that works.
pub fn check_kind(path: &Path) -> Result<(), OpenRecordingError> {
    if path.is_dir() {
        return Ok(check_lists(path)?);
    }
    match FileKind::of(path) {
        FileKind::Other(advice) if !is_mcap(path) => Err(unknown(path, advice)),
        _ => Ok(()),
    }
}

/// Kind of a file, by the ending of its name and by its first bytes.
enum FileKind {
    /// That of librealsense2.
    Realsense,
    Video,
    /// That of OpenNI2.
    Openni,
    /// None that [`open_recording`] reads, with the way that works, for a person.
    Other(&'static str),
}

impl FileKind {
    fn of(path: &Path) -> Self {
        let kind = path.extension().unwrap_or_default();
        let ending = kind.to_string_lossy().to_ascii_lowercase();
        if ["bag", "db3"].contains(&ending.as_str()) {
            Self::Realsense
        } else if VIDEO_ENDINGS.contains(&ending.as_str()) {
            Self::Video
        } else if ending == "oni" || is_recording(path) {
            Self::Openni
        } else {
            Self::Other(advice(&ending))
        }
    }
}

/// Returns the error of a file that is no recording.
fn unknown(path: &Path, advice: &'static str) -> OpenRecordingError {
    OpenRecordingError::Unknown { path: path.to_owned(), advice }
}

/// Returns a recording that is played at the speed at which it was recorded.
pub fn played(recording: OpenedSource) -> OpenedSource {
    let source = Box::new(Playback::new(recording.source));
    OpenedSource { source, ..recording }
}

/// Returns whether `path` is a file of MCAP by its name: `plumb-ros2` reads it.
pub fn is_mcap(path: &Path) -> bool {
    has_mcap_ending(path) && path.is_file()
}

/// Returns whether the name of `path` is that of a file of MCAP, which need not exist.
pub fn has_mcap_ending(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

/// Returns, for a person, what a file that is no recording may be, by the ending of its name in
/// lower case.
fn advice(ending: &str) -> &'static str {
    match ending {
        "mcap" => {
            "an MCAP recording is read by the program only: `plumb replay`, or `recording` in a \
             rig file"
        }
        "txt" | "csv" => {
            "is no recording, but a list. Of pictures: give the folder that it is in. Of places: \
             `plumb follow FILE`"
        }
        "h264" | "264" | "h265" | "hevc" | "265" => {
            "a stream of video without a container: make a file of it with \
             `ffmpeg -i FILE -c copy video.mkv`"
        }
        "zip" | "tar" | "gz" | "tgz" | "xz" | "bz2" | "zst" | "7z" => {
            "an archive: unpack it, and give the folder with the lists"
        }
        "png" | "jpg" | "jpeg" | "pgm" | "ppm" => {
            "one picture: a recording is a folder with a list of pictures, rgb.txt, whose lines \
             are `timestamp path`"
        }
        _ => {
            "no recording that Plumb reads: a folder with the lists rgb.txt and depth.txt, a \
             video, an .oni file of OpenNI2, a .bag or .db3 file of librealsense2, or an .mcap \
             file of ROS 2"
        }
    }
}

/// Opens a video file.
#[cfg(feature = "videoio")]
fn open_video(path: &Path, intrinsics: FileIntrinsics) -> Result<OpenedSource, OpenRecordingError> {
    let source = plumb_webcam::VideoFileSource::open(path, intrinsics)?;
    let (notes, intrinsics) = (source.notes().to_vec(), *source.intrinsics());
    Ok(OpenedSource { notes, ..OpenedSource::new(source, intrinsics) })
}

/// Returns the error of a program without video files.
#[cfg(not(feature = "videoio"))]
fn open_video(path: &Path, _: FileIntrinsics) -> Result<OpenedSource, OpenRecordingError> {
    let source = plumb_webcam::NotBuilt;
    Err(OpenRecordingError::NoVideo { path: path.to_owned(), source })
}

/// Opens a recording of librealsense2. A bag of ROS has the same ending and the same format.
fn open_realsense(path: &Path) -> Result<OpenedSource, OpenRecordingError> {
    let open = || {
        let library = RealSense::load()?;
        let target = plumb_realsense::Target::Recording(path.to_owned());
        plumb_realsense::open_source(&library, &target, plumb_realsense::Settings::default(), None)
    };
    let source = open().map_err(|error| match error {
        RealsenseSourceError::Realsense(_) => {
            OpenRecordingError::Bag { path: path.to_owned(), source: error }
        }
        other => other.into(),
    })?;
    let intrinsics = source.intrinsics;
    Ok(OpenedSource::new(source, intrinsics))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_kind_is_named_with_the_way_that_works() {
        let folder = tempfile::tempdir().unwrap();
        for (name, named) in [
            ("a.mcap", "plumb replay"),
            ("rgb.txt", "give the folder"),
            ("a.H264", "ffmpeg"),
            ("a.tar.gz", "unpack it"),
            ("a.png", "one picture"),
            ("a", "no recording that Plumb reads"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, b"\x89MCAP0\r\n").unwrap();
            let intrinsics = crate::camera_file::paper().unwrap().intrinsics;
            let error = open_recording(&path, intrinsics).err().unwrap().to_string();
            assert!(error.contains(name) && error.contains(named), "{error}");
        }
    }
}
