//! A recording in the TUM RGB-D format: a folder with the lists `rgb.txt` and `depth.txt`.
//!
//! A line of a list is `timestamp path`, seconds and a file relative to the folder; `#` begins a
//! comment. Colour is 8-bit PNG or JPEG, depth 16-bit PNG registered to it.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use plumb_vision::camera::Intrinsics;
use plumb_vision::frame::{FrameError, RgbdFrame};
use plumb_vision::image::{Image, ImageSize};

use super::{CameraSource, InvalidFrame, SourceError};
use crate::bounded_read;

mod error;
pub mod picture_file;

pub use error::TumError;

/// How far apart in time a colour picture and its depth may be taken, seconds: less than the 33 ms
/// between frames, so that a depth picture that was dropped is not replaced by its neighbour.
pub const MAX_TIME_DIFFERENCE: f64 = 0.020;

/// Most lines of a list that are read: 9 hours at 30 Hz.
pub const MAX_LINES: usize = 1_000_000;

/// Largest list that is read, bytes: [`MAX_LINES`] lines of 67 bytes.
pub const MAX_LIST_BYTES: u64 = 1 << 26;

/// Farthest time stamp from 0, seconds: as `f64` they are exact to a microsecond up to there. Time
/// stamps in nanoseconds since 1970 are beyond it.
const MAX_TIME: f64 = 1e10;

/// A TUM RGB-D folder as a source: one frame a line of `rgb.txt`, in the order of that file.
///
/// Each colour picture gets the depth picture that is nearest in time. Where none is within
/// [`MAX_TIME_DIFFERENCE`] the frame comes with a depth picture that is zero (no depth) throughout.
/// After an error the next call goes on with the next frame.
#[derive(Debug)]
pub struct TumFolder {
    intrinsics: Intrinsics,
    pending: VecDeque<Pending>,
    first_size: Option<ImageSize>,
    /// Time stamp of the last frame, seconds.
    now: f64,
}

/// What a call of `next_frame` will be about.
#[derive(Debug)]
enum Pending {
    /// A colour picture and, where there is one, its depth.
    Frame { time: f64, colour: PathBuf, depth: Option<PathBuf> },
    /// A line that could not be read.
    Bad(TumError),
}

/// A line of a list.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    time: f64,
    path: PathBuf,
}

impl TumFolder {
    /// The recording in `folder`, taken by a camera with `intrinsics`.
    ///
    /// Only the lists are read here, the pictures one by one later. A line of a list that cannot be
    /// understood is an error of a later [`CameraSource::next_frame`] (those of `depth.txt` first), not
    /// of this.
    ///
    /// # Errors
    /// Where `rgb.txt` or `depth.txt` cannot be read, or is longer than [`MAX_LINES`] or
    /// [`MAX_LIST_BYTES`].
    pub fn open(folder: &Path, intrinsics: Intrinsics) -> Result<Self, TumError> {
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
        Ok(Self { intrinsics, pending, first_size: None, now: 0.0 })
    }

    fn read_frame(
        &mut self,
        time: f64,
        colour: &Path,
        depth: Option<&Path>,
    ) -> Result<RgbdFrame, TumError> {
        let picture = picture_file::read_colour(colour)?;
        let size = picture.size();
        let ranges = match depth {
            Some(path) => picture_file::read_depth(path)?,
            None => Image::filled(size.width, size.height, 0),
        };
        let frame = RgbdFrame::new(time, picture, ranges, self.intrinsics).map_err(|error| {
            let culprit = match (&error, depth) {
                (FrameError::Size { .. }, Some(depth)) => depth,
                _ => colour,
            };
            InvalidFrame { origin: culprit.display().to_string(), error }
        })?;
        let first = *self.first_size.get_or_insert(size);
        if size != first {
            return Err(TumError::OtherSize { path: colour.to_path_buf(), size, first });
        }
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

/// The lines of the list `name` in `folder`, those that are no entry as errors.
fn read_list(folder: &Path, name: &str) -> Result<Vec<Result<Entry, TumError>>, TumError> {
    let path = folder.join(name);
    let bytes = bounded_read::read(&path, MAX_LIST_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.trim_start_matches('\u{feff}').lines();
    if lines.clone().nth(MAX_LINES).is_some() {
        return Err(TumError::TooManyLines { path, limit: MAX_LINES });
    }
    Ok(lines
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(line, text)| {
            parse_entry(folder, text).ok_or_else(|| TumError::Line {
                path: path.clone(),
                line,
                text: bounded_read::excerpt(text),
            })
        })
        .collect())
}

/// `timestamp path`; `None` where it is not that.
fn parse_entry(folder: &Path, line: &str) -> Option<Entry> {
    let (time, path) = line.split_once(char::is_whitespace)?;
    let time: f64 = time.parse().ok()?;
    (time.abs() <= MAX_TIME).then(|| Entry { time, path: folder.join(path.trim()) })
}

/// The entry of `sorted` that is nearest to `time`, within [`MAX_TIME_DIFFERENCE`].
fn nearest(sorted: &[Entry], time: f64) -> Option<&Entry> {
    let after = sorted.partition_point(|e| e.time < time);
    let distance = |e: &&Entry| (e.time - time).abs();
    let candidates = sorted[after.saturating_sub(1)..].iter().take(2);
    candidates
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .filter(|e| distance(e) <= MAX_TIME_DIFFERENCE)
}

#[cfg(test)]
mod tests {
    use opencv::core::{CV_8UC1, CV_8UC3, CV_16UC1, Mat, Scalar};
    use opencv::imgcodecs::imwrite_def;
    use tempfile::TempDir;

    use super::*;

    const INTRINSICS: Intrinsics =
        Intrinsics { fx: 500.0, fy: 500.0, cx: 15.5, cy: 11.5, depth_scale: 5000.0 };

    fn picture(folder: &TempDir, name: &str, typ: i32, width: i32, value: f64) {
        let mat = Mat::new_rows_cols_with_default(24, width, typ, Scalar::all(value)).unwrap();
        imwrite_def(folder.path().join(name).to_str().unwrap(), &mat).unwrap();
    }

    fn recording(rgb: &str, depth: &str) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("rgb.txt"), rgb).unwrap();
        std::fs::write(folder.path().join("depth.txt"), depth).unwrap();
        for i in 0..4 {
            picture(&folder, &format!("c{i}.png"), CV_8UC3, 32, f64::from(i));
            picture(&folder, &format!("d{i}.png"), CV_16UC1, 32, f64::from(1000 + i));
        }
        folder
    }

    /// (time, blue of the first pixel, depth units of the first pixel) or the error's text, to the
    /// end.
    fn read_all(folder: &TempDir) -> Vec<Result<(f64, u8, u16), String>> {
        let mut source = TumFolder::open(folder.path(), INTRINSICS).unwrap();
        let mut all = Vec::new();
        loop {
            match source.next_frame() {
                Ok(None) => return all,
                Ok(Some(f)) => {
                    let blue = f.colour().get(0, 0).unwrap()[0];
                    all.push(Ok((f.time(), blue, f.depth().get(0, 0).unwrap())));
                }
                Err(e) => all.push(Err(e.to_string())),
            }
        }
    }

    #[test]
    fn colour_and_depth_are_paired_by_nearest_time() {
        let rgb = "# timestamp path\n10.000 c0.png\n10.033 c1.png\n10.066 c2.png\n10.100 c3.png\n";
        // Not in order, one dropped, one 15 ms late, one 21 ms late.
        let depth = "10.048 d1.png\n\n10.002 d0.png\n10.121000 d3.png\n";
        let frames = read_all(&recording(rgb, depth));
        let expected = [(10.0, 0, 1000), (10.033, 1, 1001), (10.066, 2, 1001), (10.1, 3, 0)];
        assert_eq!(frames, expected.map(Ok));
    }

    #[test]
    fn broken_files_are_named_and_reading_goes_on() {
        let rgb = "0.0 c0.png\nx c1.png\n0.1 gone.png\n0.2\n0.3 torn.png\n0.4 grey.png\n0.5 wide.png\n\
                   0.6 c2.png\n0.7 c3.png\n0.8 c1.png\n0.9 both.png\n1.0 c3.png\n";
        let depth = "0.0 d0.png\n0.1 d1.png\nnan d2.png\n0.3 d1.png\n0.4 d1.png\n0.5 d1.png\n\
                     0.6 d8.png\n0.7 dgone.png\n0.8 d1.png\n0.9 dboth.png\n1.0 d3.png\n";
        let folder = recording(rgb, depth);
        let good = std::fs::read(folder.path().join("c0.png")).unwrap();
        std::fs::write(folder.path().join("torn.png"), &good[..good.len() / 2]).unwrap();
        picture(&folder, "grey.png", CV_8UC1, 32, 1.0);
        picture(&folder, "wide.png", CV_8UC3, 40, 1.0);
        picture(&folder, "d8.png", CV_8UC1, 32, 1.0);
        picture(&folder, "both.png", CV_8UC3, 40, 1.0);
        picture(&folder, "dboth.png", CV_16UC1, 40, 1.0);
        let all = read_all(&folder);
        let expected = [
            Err("depth.txt:3: "),
            Ok((0.0, 0, 1000)),
            Err("rgb.txt:2: "),
            Err("gone.png: cannot be read"),
            Err("rgb.txt:4: "),
            Err("torn.png: not a picture"),
            Err("grey.png: the colour picture must be 8-bit BGR"),
            Err("d1.png: the colour picture is 40x24 but the depth picture is 32x24"),
            Err("d8.png: the depth picture must be 16-bit"),
            Err("dgone.png: cannot be read"),
            Ok((0.8, 1, 1001)),
            Err("both.png: 40x24, but the recording's first picture is 32x24"),
            Ok((1.0, 3, 1003)),
        ];
        assert_eq!(all.len(), expected.len(), "{all:#?}");
        for (got, want) in all.iter().zip(expected) {
            match (got, want) {
                (Err(got), Err(want)) => assert!(got.contains(want), "{want:?} in {got:?}"),
                (got, want) => assert_eq!(got.clone().ok(), want.ok(), "{got:?} {want:?}"),
            }
        }
    }

    #[test]
    fn what_a_list_names_must_be_a_regular_file() {
        let rgb = "0.0 pipe.png\n0.1 /dev/zero\n0.2 .\n0.3 c3.png\n";
        let folder = recording(rgb, "0.3 d3.png\n");
        nix::unistd::mkfifo(&folder.path().join("pipe.png"), nix::sys::stat::Mode::S_IRWXU)
            .unwrap();
        let all = read_all(&folder);
        for (got, named) in
            all.iter().zip(["pipe.png: is a named pipe", "/dev/zero: is a device", "is a folder"])
        {
            let error = got.as_ref().unwrap_err();
            assert!(
                error.contains(named) && error.contains("must be a regular file"),
                "{named:?} in {error:?}"
            );
        }
        assert_eq!(all[3..], [Ok((0.3, 3, 1003))]);
    }

    #[test]
    fn a_long_line_is_not_quoted_whole() {
        let all = read_all(&recording(&"x".repeat(100_000), ""));
        assert!(all[0].as_ref().is_err_and(|error| error.len() < 400), "{all:?}");
    }

    #[test]
    fn time_stamps_that_are_no_seconds_are_refused() {
        let all = read_all(&recording(
            "1e19 c0.png\n1305031102175304000 c1.png\n1305031102.175304 c2.png\n",
            "",
        ));
        assert!(all[0].as_ref().is_err_and(|error| error.contains("rgb.txt:1: ")), "{all:?}");
        assert!(all[1].as_ref().is_err_and(|error| error.contains("rgb.txt:2: ")), "{all:?}");
        assert_eq!(all[2..], [Ok((1_305_031_102.175_304, 2, 0))]);
    }

    #[test]
    fn a_list_that_is_too_long_is_refused() {
        let folder = recording("", "");
        std::fs::write(folder.path().join("rgb.txt"), "0 c0.png\n".repeat(MAX_LINES)).unwrap();
        assert_eq!(TumFolder::open(folder.path(), INTRINSICS).unwrap().pending.len(), MAX_LINES);
        std::fs::write(folder.path().join("rgb.txt"), "0 c0.png\n".repeat(MAX_LINES + 1)).unwrap();
        let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err().to_string();
        assert!(error.contains("rgb.txt: it has more than 1000000 lines"), "{error}");
        let large = std::fs::File::create(folder.path().join("rgb.txt")).unwrap();
        large.set_len(MAX_LIST_BYTES + 1).unwrap();
        let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err().to_string();
        assert!(error.contains("rgb.txt: is too large"), "{error}");
    }

    #[test]
    fn a_folder_without_lists_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err();
        assert!(error.to_string().contains("depth.txt"), "{error}");
    }
}
