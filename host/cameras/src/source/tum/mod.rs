//! Recordings in the TUM RGB-D format: a folder with the lists `rgb.txt` and `depth.txt`.
//!
//! A line of a list is `timestamp path`: seconds, and a file relative to the folder. `#` starts a
//! comment. Colour is PNG, JPEG, PGM or PPM; depth is 16-bit PNG or PGM, registered to colour.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::{FrameError, RgbdFrame};
use plumb_frame::image::{Image, ImageSize};

use super::camera_source::CameraSource;
use super::error::{InvalidFrame, SourceError};
use super::resolution::FileIntrinsics;
use list::{Entry, nearest, read_list};

mod error;
mod image_file;
mod list;

pub use error::TumError;
pub use image_file::MAX_BYTES;
pub use list::{MAX_LINES, MAX_LIST_BYTES, MAX_TIME_DIFFERENCE};

/// Recording in a TUM RGB-D folder: one frame for each line of `rgb.txt`, in the order of that
/// list.
///
/// Each colour image gets the depth image nearest in time. Where none is within
/// [`MAX_TIME_DIFFERENCE`], the frame has a depth image of zeros (unknown). No error ends the
/// recording.
#[derive(Debug)]
pub struct TumFolder {
    intrinsics: FileIntrinsics,
    pending: VecDeque<Pending>,
    /// Size of the first frame.
    first_size: Option<ImageSize>,
    /// Time stamp of the last frame, seconds.
    now: f64,
}

/// Subject of a later call of `next_frame`.
#[derive(Debug)]
enum Pending {
    /// A colour image and, where there is one, its depth image.
    Frame { time: f64, colour: PathBuf, depth: Option<PathBuf> },
    /// An invalid line of a list.
    Bad(TumError),
}

impl TumFolder {
    /// Opens the recording in `folder`, taken by a camera with `intrinsics`.
    ///
    /// This reads the lists only; [`CameraSource::next_frame`] reads the images, and also returns
    /// the errors for invalid lines (those of `depth.txt` first).
    ///
    /// # Errors
    /// Where `rgb.txt` or `depth.txt` cannot be read, or is longer than [`MAX_LINES`] or
    /// [`MAX_LIST_BYTES`].
    pub fn open(folder: &Path, intrinsics: impl Into<FileIntrinsics>) -> Result<Self, TumError> {
        let mut pending = VecDeque::new();
        let mut depth = Vec::new();
        for entry in read_list(folder, "depth.txt")? {
            match entry {
                Ok(entry) => depth.push(entry),
                Err(error) => pending.push_back(Pending::Bad(error)),
            }
        }
        depth.sort_by(|a, b| a.time.total_cmp(&b.time));
        pending.extend(read_list(folder, "rgb.txt")?.into_iter().map(|entry| match entry {
            Ok(Entry { time, path }) => {
                let depth = nearest(&depth, time).map(|d| d.path.clone());
                Pending::Frame { time, colour: path, depth }
            }
            Err(error) => Pending::Bad(error),
        }));
        Ok(Self { intrinsics: intrinsics.into(), pending, first_size: None, now: 0.0 })
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics.intrinsics
    }

    /// Reads the images of a frame.
    fn read_frame(
        &mut self,
        time: f64,
        colour: &Path,
        depth: Option<&Path>,
    ) -> Result<RgbdFrame, TumError> {
        let image = image_file::read_colour(colour)?;
        let size = image.size();
        let depth_image = match depth {
            Some(path) => image_file::read_depth(path)?,
            None => Image::filled(size.width, size.height, 0),
        };
        let frame = RgbdFrame::new(time, image, depth_image, *self.intrinsics());
        let frame = frame.map_err(|error| {
            let culprit = match (&error, depth) {
                (FrameError::Size { .. }, Some(depth)) => depth,
                _ => colour,
            };
            InvalidFrame { origin: culprit.display().to_string(), error }
        })?;
        let path = colour.to_path_buf();
        match self.first_size {
            Some(first) if size != first => Err(TumError::OtherSize { path, size, first })?,
            Some(_) => {}
            None => {
                self.intrinsics.of_pictures(size, path.display())?;
            }
        }
        self.first_size = Some(size);
        Ok(frame)
    }
}

impl CameraSource for TumFolder {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        match self.pending.pop_front() {
            None => Ok(None),
            Some(Pending::Bad(error)) => Err(error.into()),
            Some(Pending::Frame { time, colour, depth }) => {
                self.now = time;
                self.read_frame(time, &colour, depth.as_deref())
                    .map(Some)
                    .map_err(|error| SourceError::new(error).with_stamp(time))
            }
        }
    }

    /// Returns the time stamp of the last frame, seconds; 0 before the first one.
    fn now(&self) -> f64 {
        self.now
    }

    fn is_live(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests;
