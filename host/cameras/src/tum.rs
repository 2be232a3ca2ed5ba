//! Recordings in the TUM RGB-D format: a folder with the lists `rgb.txt` and `depth.txt`, or
//! `color.txt` and `aligned_depth.txt`. A camera without depth has the first only. In place of both
//! there may be an association file, `associations.txt`.
//!
//! A line of a list is `timestamp path`: seconds, and a file relative to the folder. `#` starts a
//! comment. A line of an association file is `timestamp path timestamp path`. Colour is PNG, JPEG,
//! PGM or PPM; depth is 16-bit PNG or PGM, registered to colour.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use plumb_config::bounded_read;
use plumb_frame::camera::Intrinsics;
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::{FrameError, RgbdFrame};
use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use plumb_pictures::decode;
use plumb_pictures::raw;

use list::{Entry, Pair, nearest, read_list, read_pairs};

pub use error::TumError;
pub use list::{MAX_LINES, MAX_LIST_BYTES, MAX_TIME_DIFFERENCE};

mod error;
mod list;

/// Names of the list of colour pictures.
const COLOUR_LISTS: [&str; 3] = ["rgb.txt", "color.txt", "colour.txt"];

/// Names of the list of depth pictures, registered to colour.
const DEPTH_LISTS: [&str; 2] = ["depth.txt", "aligned_depth.txt"];

/// Names of the list of pairs of pictures, where there is no list of colour pictures.
const ASSOCIATIONS: [&str; 4] =
    ["associations.txt", "association.txt", "associate.txt", "assoc.txt"];

/// Recording in a TUM RGB-D folder: one frame for each line of the list of colour pictures, in the
/// order of their times.
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
    /// the errors for invalid lines (those of the depth pictures first).
    ///
    /// # Errors
    /// Where there is no list of colour pictures and no association file, or no list of depth
    /// pictures and the camera has depth; where a list cannot be read, or is longer than
    /// [`MAX_LINES`] or [`MAX_LIST_BYTES`].
    pub fn open(folder: &Path, intrinsics: impl Into<FileIntrinsics>) -> Result<Self, TumError> {
        let intrinsics = intrinsics.into();
        let pending = match lists(folder, intrinsics.intrinsics.has_depth())? {
            Lists::Apart { colour, depth } => with_nearest_depth(folder, colour, depth)?,
            Lists::Associated(name) => {
                in_order(read_pairs(folder, name)?.into_iter().map(|pair| {
                    let Pair { colour: Entry { time, path: colour }, depth } = pair?;
                    Ok((time, Pending::Frame { time, colour, depth: Some(depth) }))
                }))
            }
        };
        Ok(Self { intrinsics, pending, first_size: None, now: 0.0 })
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
        let image = read_colour(colour)?;
        let size = image.size();
        let depth_image = match depth {
            Some(path) => read_depth(path)?,
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

/// Returns the frames of a list of colour pictures, each with the depth picture nearest in time,
/// after the invalid lines of the list of depth pictures.
///
/// # Errors
/// Where a list cannot be read or is too long.
fn with_nearest_depth(
    folder: &Path,
    colour: &str,
    depth: Option<&str>,
) -> Result<VecDeque<Pending>, TumError> {
    let mut pending = VecDeque::new();
    let mut depths = Vec::new();
    for entry in depth.map_or(Ok(Vec::new()), |list| read_list(folder, list))? {
        match entry {
            Ok(entry) => depths.push(entry),
            Err(error) => pending.push_back(Pending::Bad(error)),
        }
    }
    depths.sort_by(|a, b| a.time.total_cmp(&b.time));
    pending.extend(in_order(read_list(folder, colour)?.into_iter().map(|entry| {
        let Entry { time, path: colour } = entry?;
        let depth = nearest(&depths, time).map(|depth| depth.path.clone());
        Ok((time, Pending::Frame { time, colour, depth }))
    })));
    Ok(pending)
}

/// Returns the frames of a list with their times, seconds, in the order of those. An invalid line
/// keeps its place after the picture before it.
fn in_order(lines: impl Iterator<Item = Result<(f64, Pending), TumError>>) -> VecDeque<Pending> {
    let mut last = f64::NEG_INFINITY;
    let mut frames: Vec<(f64, Pending)> = lines
        .map(|line| match line {
            Ok((time, frame)) => {
                last = time;
                (time, frame)
            }
            Err(error) => (last, Pending::Bad(error)),
        })
        .collect();
    frames.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    frames.into_iter().map(|(_, frame)| frame).collect()
}

/// Names of the lists of a recording.
enum Lists {
    /// Those of colour, and of depth where the recording has it.
    Apart { colour: &'static str, depth: Option<&'static str> },
    /// That of the pairs of pictures.
    Associated(&'static str),
}

/// Returns the names of the lists in `folder`.
///
/// # Errors
/// Where there is no list of colour and no association file, or no list of depth for a camera that
/// has depth.
fn lists(folder: &Path, has_depth: bool) -> Result<Lists, TumError> {
    if list::present(folder, &COLOUR_LISTS).is_none()
        && let Some(name) = list::present(folder, &ASSOCIATIONS)
    {
        return Ok(Lists::Associated(name));
    }
    let folder_or_usual = |names: &[&'static str]| {
        // What is no folder has its own error when the list is read.
        list::present(folder, names).or((!folder.is_dir()).then_some(names[0]))
    };
    let missing = |names: &[&'static str], advice| TumError::NoList {
        folder: folder.to_owned(),
        names: names.join(" or "),
        advice,
    };
    let advice = match folder.join("metadata.yaml").exists() {
        true => "; of a folder of rosbag2 give the .mcap file in it",
        false => "",
    };
    let colour = folder_or_usual(&COLOUR_LISTS).ok_or_else(|| missing(&COLOUR_LISTS, advice))?;
    let depth = folder_or_usual(&DEPTH_LISTS);
    if depth.is_none() && has_depth {
        let advice = "; for a camera without depth set `depth_scale = \"none\"` in its file";
        return Err(missing(&DEPTH_LISTS, advice));
    }
    Ok(Lists::Apart { colour, depth })
}

/// Checks that there is a list of pictures in `folder`.
pub(crate) fn check_lists(folder: &Path) -> Result<(), TumError> {
    lists(folder, false).map(drop)
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
}

/// Most bytes of an image file: an uncompressed image of [`decode::MAX_PIXELS`], and a reserve.
pub const MAX_BYTES: u64 = 1 << 28;

/// Reads the colour image in the file at `path`.
///
/// # Errors
/// Where the file cannot be read, is no regular file, or is larger than [`MAX_BYTES`]; as
/// [`decode::colour`].
fn read_colour(path: &Path) -> Result<ColourImage, TumError> {
    let bytes = bounded_read::read(path, MAX_BYTES)?;
    decode::colour(&bytes).map_err(|error| TumError::decode(path, error))
}

/// Reads the depth image (16-bit, one channel) in the file at `path`. 0 and 65535 are unknown.
///
/// # Errors
/// As [`read_colour`].
fn read_depth(path: &Path) -> Result<DepthImage, TumError> {
    let bytes = bounded_read::read(path, MAX_BYTES)?;
    let depth = decode::depth(&bytes).map_err(|error| TumError::decode(path, error))?;
    Ok(raw::known_depth(depth))
}

#[cfg(test)]
mod tests;
