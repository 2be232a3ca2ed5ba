//! Video files.

use std::fs::File;
use std::path::{Path, PathBuf};

use opencv::videoio::{
    CAP_FFMPEG, CAP_OPENCV_MJPEG, CAP_PROP_FPS, CAP_PROP_ORIENTATION_AUTO, CAP_PROP_POS_MSEC,
    CAP_PROP_SAR_DEN, CAP_PROP_SAR_NUM, VideoCapture, VideoCaptureTrait, VideoCaptureTraitConst,
};

use crate::error::WebcamError;
use crate::picture::{Picture, check_size, failed, retrieve};
use crate::settings::Mode;
use crate::tracks::video_tracks;

/// Readers of OpenCV in the order in which they are tried: FFmpeg knows all formats, the other one,
/// which every OpenCV has, MJPEG in AVI.
const READERS: [i32; 2] = [CAP_FFMPEG, CAP_OPENCV_MJPEG];
/// Rate of a file that states none, pictures per second.
const USUAL_RATE: f64 = 30.0;

/// Video file, which is read once, picture by picture.
#[derive(Debug)]
pub struct VideoFile {
    path: PathBuf,
    capture: VideoCapture,
    mode: Mode,
    /// Parts of the file that are not used, for a person.
    notes: Vec<String>,
    /// The first picture, until it is taken.
    first: Option<Picture>,
    /// Time stamp of the last picture, seconds.
    last: f64,
}

impl VideoFile {
    /// Opens the file at `path` and reads its first picture.
    ///
    /// # Errors
    /// Where the file cannot be opened, or is no video that OpenCV knows.
    pub fn open(path: &Path) -> Result<Self, WebcamError> {
        File::open(path).map_err(|source| WebcamError::Open { path: path.to_owned(), source })?;
        let failed = failed(path);
        let mut opened = None;
        for reader in READERS {
            opened = open_with(reader, path)?;
            if opened.is_some() {
                break;
            }
        }
        let Some((capture, first)) = opened else {
            return Err(WebcamError::Refused { path: path.to_owned(), is_device: false });
        };
        let rate = capture.get(CAP_PROP_FPS).map_err(&failed)?;
        let rate = if rate.is_finite() && rate > 0.0 { rate } else { USUAL_RATE };
        let mode = Mode { width: first.width, height: first.height, rate };
        let notes = notes(path, &capture)?;
        Ok(Self { path: path.to_owned(), capture, mode, notes, first: Some(first), last: 0.0 })
    }

    /// Returns what the file has and is not used, for a person: further tracks, and the shape of
    /// its pixels.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the size of the pictures, and their rate.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Returns the next picture; `None` after the last one. Its time is that of the file, or one
    /// period after the picture before it where the file states none.
    ///
    /// # Errors
    /// Where the picture has another size, or OpenCV fails.
    pub fn next_picture(&mut self) -> Result<Option<Picture>, WebcamError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let failed = failed(&self.path);
        if !self.capture.grab().map_err(&failed)? {
            return Ok(None);
        }
        let stamp = self.capture.get(CAP_PROP_POS_MSEC).map_err(&failed)? * 1e-3;
        self.last = if stamp > self.last { stamp } else { self.last + 1.0 / self.mode.rate };
        let picture = retrieve(&mut self.capture, self.last).map_err(&failed)?;
        let size = (self.mode.width, self.mode.height);
        picture.map(|picture| check_size(picture, size, &self.path)).transpose()
    }
}

/// Returns what the file at `path` has and is not used, for a person.
fn notes(path: &Path, capture: &VideoCapture) -> Result<Vec<String>, WebcamError> {
    let mut notes = Vec::new();
    let open = |source| WebcamError::Open { path: path.to_owned(), source };
    let tracks = video_tracks(path).map_err(open)?;
    if tracks > 1 {
        notes.push(format!(
            "{}: the file has {tracks} video tracks, and only the first one is read: depth in \
             another one is not used",
            path.display()
        ));
    }
    let get = |property| capture.get(property).map_err(failed(path));
    let [width, height] = [get(CAP_PROP_SAR_NUM)?, get(CAP_PROP_SAR_DEN)?];
    if width > 0.0 && height > 0.0 && width != height {
        notes.push(format!(
            "{}: the file asks for pixels that are {width}:{height} as wide as high. They are read \
             as they are stored: the camera file must have the lens of these pixels",
            path.display()
        ));
    }
    Ok(notes)
}

/// Opens the file at `path` with one of OpenCV's readers, and reads its first picture. Returns
/// `None` where the reader does not know the file.
fn open_with(reader: i32, path: &Path) -> Result<Option<(VideoCapture, Picture)>, WebcamError> {
    let failed = failed(path);
    let mut capture = VideoCapture::from_file(path, reader).map_err(&failed)?;
    if !capture.is_opened().map_err(&failed)? {
        return Ok(None);
    }
    // The intrinsics belong to the pixels as they are stored, however the file says that they are
    // to be shown. A reader without this property does not turn them.
    let _ = capture.set(CAP_PROP_ORIENTATION_AUTO, 0.0).map_err(&failed)?;
    let is_read = capture.grab().map_err(&failed)?;
    let first = if is_read { retrieve(&mut capture, 0.0).map_err(&failed)? } else { None };
    Ok(first.map(|first| (capture, first)))
}
