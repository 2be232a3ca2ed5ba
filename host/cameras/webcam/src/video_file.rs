//! Video files.

mod error;
mod picture;
mod source;
mod tracks;

use std::fs::File;
use std::path::{Path, PathBuf};

use opencv::videoio::{
    CAP_FFMPEG, CAP_OPENCV_MJPEG, CAP_PROP_FPS, CAP_PROP_ORIENTATION_AUTO, CAP_PROP_POS_MSEC,
    CAP_PROP_SAR_DEN, CAP_PROP_SAR_NUM, VideoCapture, VideoCaptureTrait, VideoCaptureTraitConst,
};

use crate::mode::Mode;

pub use error::{LibraryError, VideoFileError};
pub use picture::Picture;
pub use source::VideoFileSource;

use picture::{failed, retrieve};
use tracks::video_tracks;

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
    times: PictureTimes,
}

/// Times of a file's pictures.
#[derive(Debug)]
struct PictureTimes {
    /// Usual time from one picture to the next, seconds.
    period: f64,
    /// Time of the last picture, seconds.
    last: f64,
    /// Whether one period lies between all pictures whose times the file states.
    is_even: bool,
}

impl PictureTimes {
    /// Returns the time of a picture for which OpenCV states `stated`, seconds; `None` where it is
    /// unknown. OpenCV states 0 for the pictures that a decoder still holds at the end of the file
    /// (opencv/opencv#22141).
    fn next(&mut self, stated: f64) -> Option<f64> {
        if stated > self.last {
            self.is_even &= (stated - self.last - self.period).abs() < 0.5 * self.period;
            self.last = stated;
        } else if self.is_even {
            self.last += self.period;
        } else {
            return None;
        }
        Some(self.last)
    }
}

impl VideoFile {
    /// Opens the file at `path` and reads its first picture.
    ///
    /// # Errors
    /// Where the file cannot be opened, or is no video that OpenCV knows.
    pub fn open(path: &Path) -> Result<Self, VideoFileError> {
        File::open(path)
            .map_err(|source| VideoFileError::Open { path: path.to_owned(), source })?;
        let failed = failed(path);
        let mut opened = None;
        for reader in READERS {
            opened = open_with(reader, path)?;
            if opened.is_some() {
                break;
            }
        }
        let Some((capture, first)) = opened else {
            return Err(VideoFileError::Refused { path: path.to_owned() });
        };
        let rate = capture.get(CAP_PROP_FPS).map_err(&failed)?;
        let rate = if rate.is_finite() && rate > 0.0 { rate } else { USUAL_RATE };
        let mode = Mode { size: first.colour.size(), rate };
        let notes = notes(path, &capture)?;
        let times = PictureTimes { period: 1.0 / rate, last: 0.0, is_even: true };
        Ok(Self { path: path.to_owned(), capture, mode, notes, first: Some(first), times })
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
    /// Where the picture has another size, or no time in a file of uneven times, or OpenCV fails.
    pub fn next_picture(&mut self) -> Result<Option<Picture>, VideoFileError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let failed = failed(&self.path);
        if !self.capture.grab().map_err(&failed)? {
            return Ok(None);
        }
        let stamp = self.capture.get(CAP_PROP_POS_MSEC).map_err(&failed)? * 1e-3;
        let time = self.times.next(stamp);
        let time = time.ok_or_else(|| VideoFileError::NoTime { path: self.path.clone() })?;
        let picture = retrieve(&mut self.capture, time).map_err(&failed)?;
        match picture.map(|picture| (picture.colour.size(), picture)) {
            Some((size, picture)) if size == self.mode.size => Ok(Some(picture)),
            Some((size, _)) => Err(VideoFileError::OtherSize { path: self.path.clone(), size }),
            None => Ok(None),
        }
    }
}

/// Returns what the file at `path` has and is not used, for a person.
fn notes(path: &Path, capture: &VideoCapture) -> Result<Vec<String>, VideoFileError> {
    let mut notes = Vec::new();
    let open = |source| VideoFileError::Open { path: path.to_owned(), source };
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
fn open_with(reader: i32, path: &Path) -> Result<Option<(VideoCapture, Picture)>, VideoFileError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the times of pictures, in tenths of a second, at a usual period of 0.1 s.
    fn times<const N: usize>(stated: [i32; N]) -> [Option<i32>; N] {
        let mut times = PictureTimes { period: 0.1, last: 0.0, is_even: true };
        stated.map(|it| times.next(f64::from(it) / 10.0).map(|time| (10.0 * time).round() as i32))
    }

    #[test]
    fn a_time_that_is_not_stated_is_unknown_where_the_others_are_uneven() {
        assert_eq!(times([1, 2, 0, 0]), [Some(1), Some(2), Some(3), Some(4)]);
        assert_eq!(times([0, 0, 0]), [Some(1), Some(2), Some(3)]);
        assert_eq!(times([1, 5, 6, 0, 0]), [Some(1), Some(5), Some(6), None, None]);
    }
}
