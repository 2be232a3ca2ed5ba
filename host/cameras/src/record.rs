//! Recording of frames as a TUM RGB-D folder. `plumb replay` makes the same detections from it.
//!
//! Beside `rgb.txt`, `depth.txt` and the PNG files, the folder has the camera file of the run with
//! the intrinsics that were used. Depth is written with the format's 5000 units in a metre, where
//! that is exact.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use plumb_config::whole_writes::{WholeWrites, check_named, write_whole};
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::BoxedError;
use plumb_pictures::{png, raw};
use thiserror::Error;

use crate::camera_file::{DISTORTION_KEYS, NO_DEPTH};

/// File name of the camera file in a recording.
pub const CAMERA_FILE: &str = "camera.toml";

/// Depth units in a metre of the TUM RGB-D format.
const TUM_SCALE: f64 = 5000.0;

/// Frames that may wait to be written: 2 s at 30 Hz, 100 MB at 640x480.
const QUEUE: usize = 64;

/// Behaviour where frames come faster than they can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overflow {
    /// Frames are dropped and counted: a run never waits for the disk.
    Drop,
    /// The run waits: in virtual time this costs nothing.
    Block,
}

/// Summary of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// The folder.
    pub folder: PathBuf,
    /// Frames in the recording.
    pub frames: u64,
    /// Frames that were dropped, because they came faster than they could be written.
    pub dropped: u64,
}

/// Empty folder for a recording.
#[derive(Debug)]
pub struct RecordFolder(PathBuf);

/// Recorder, which writes frames in a thread of its own.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    overflow: Overflow,
    frames: SyncSender<RgbdFrame>,
    writer: JoinHandle<Result<u64, RecordError>>,
    dropped: u64,
}

impl RecordFolder {
    /// Creates the folder `path`, and those above it. A symbolic link to an empty folder is that
    /// folder.
    ///
    /// # Errors
    /// [`RecordError::Exists`] where `path` exists and is not an empty folder; where it cannot be
    /// created.
    pub fn create(path: &Path) -> Result<Self, RecordError> {
        fs::create_dir_all(path).map_err(|error| match path.symlink_metadata() {
            // The path exists and is no folder.
            Ok(_) => RecordError::Exists(path.to_owned()),
            Err(_) => io_error("create", path)(error),
        })?;
        let mut entries = fs::read_dir(path).map_err(io_error("look into", path))?;
        if entries.next().is_some() {
            return Err(RecordError::Exists(path.to_owned()));
        }
        Ok(Self(path.to_owned()))
    }

    /// Returns the path for a device's own recording.
    pub fn oni(&self) -> PathBuf {
        self.0.join("recording.oni")
    }

    /// Checks the device's own recording at `oni`, where there is one.
    ///
    /// # Errors
    /// What is wrong with it, for a person.
    pub fn check_oni(oni: &Path) -> Result<(), String> {
        if oni.exists() { plumb_openni::check_recording(oni) } else { Ok(()) }
    }

    /// Starts a recording of frames with `intrinsics`. `camera` is the text of the camera file.
    ///
    /// # Errors
    /// Where a file cannot be created.
    pub fn begin(
        self,
        camera: &str,
        intrinsics: &Intrinsics,
        overflow: Overflow,
    ) -> Result<Recorder, RecordError> {
        let folder = self.0;
        let (factor, scale) = scale(intrinsics.depth_scale);
        let described = camera_file(camera, &Intrinsics { depth_scale: scale, ..*intrinsics })?;
        let path = folder.join(CAMERA_FILE);
        write_whole(&path, described.as_bytes()).map_err(io_error("write", &path))?;
        let mut writer = Writer::create(&folder, factor)?;
        let (frames, incoming) = sync_channel(QUEUE);
        let thread = thread::Builder::new().name("recorder".to_owned());
        let writer = thread
            .spawn(move || writer.run(&incoming))
            .map_err(io_error("begin to write to", &folder))?;
        Ok(Recorder { folder, overflow, frames, writer, dropped: 0 })
    }
}

impl Recorder {
    /// Queues a frame for writing.
    pub fn add(&mut self, frame: &RgbdFrame) {
        // finish() returns the error of a writer that has ended.
        self.dropped += match self.overflow {
            Overflow::Block => u64::from(self.frames.send(frame.clone()).is_err()),
            Overflow::Drop => match self.frames.try_send(frame.clone()) {
                Ok(()) => 0,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => 1,
            },
        };
    }

    /// Returns the number of frames dropped so far.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Writes the queued frames, and ends the recording.
    ///
    /// # Errors
    /// Where a file could not be written. The frames before it are complete.
    pub fn finish(self) -> Result<Recording, RecordError> {
        drop(self.frames);
        let frames = self.writer.join().map_err(|_| RecordError::Thread)??;
        Ok(Recording { folder: self.folder, frames, dropped: self.dropped })
    }
}

/// Returns the factor for depth values, and the resulting units in a metre: the format's where the
/// factor is an integer, else `own`, unchanged (0 of a camera without depth).
fn scale(own: f64) -> (u16, f64) {
    let factor = (TUM_SCALE / own).round();
    if (1.0..=1000.0).contains(&factor) && factor * own == TUM_SCALE {
        (factor as u16, TUM_SCALE)
    } else {
        (1, own)
    }
}

/// Replaces the intrinsics in the text of a camera file.
fn camera_file(text: &str, intrinsics: &Intrinsics) -> Result<String, RecordError> {
    let mut table: toml::Table = text
        .parse()
        .map_err(|error: toml::de::Error| RecordError::Camera(error.message().to_owned()))?;
    let Intrinsics { fx, fy, cx, cy, depth_scale, distortion } = *intrinsics;
    let depth_scale: toml::Value =
        if intrinsics.has_depth() { depth_scale.into() } else { NO_DEPTH.into() };
    let entries = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    let coefficients = distortion.map(|lens| lens.coefficients().to_array());
    let distortion = DISTORTION_KEYS.into_iter().zip(coefficients.into_iter().flatten());
    let mut intrinsics: toml::Table = entries
        .into_iter()
        .chain(distortion)
        .map(|(key, value)| (key.to_owned(), value.into()))
        .collect();
    intrinsics.insert("depth_scale".to_owned(), depth_scale);
    table.insert("intrinsics".to_owned(), intrinsics.into());
    toml::to_string(&table).map_err(|error| RecordError::Camera(error.to_string()))
}

/// Failure of a recording.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The path exists, and is not an empty folder.
    #[error(
        "{} exists already and is not an empty folder: recordings are never overwritten; give \
         another folder or move it away",
        .0.display()
    )]
    Exists(PathBuf),
    /// A file operation failed.
    #[error("the recording: cannot {action} {}", .path.display())]
    Io {
        /// The operation.
        action: &'static str,
        /// Its file or folder.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The camera file cannot be written with other intrinsics.
    #[error("the recording: the camera file: {0}")]
    Camera(String),
    /// An image cannot be encoded.
    #[error("the recording: cannot encode {}", .path.display())]
    Encode {
        /// File of the image.
        path: PathBuf,
        /// Error of the encoder.
        #[source]
        error: BoxedError,
    },
    /// The recording ended early.
    #[error("{}", kept(*.frames, *.time_s))]
    Ended {
        /// Number of its whole frames, the first ones.
        frames: u64,
        /// Time from the first to the last of them, seconds.
        time_s: f64,
        /// Why it ended.
        #[source]
        error: Box<Self>,
    },
    /// The writing thread panicked.
    #[error("the recording's thread broke down")]
    Thread,
}

/// Returns how much of a recording is there, for a person.
fn kept(frames: u64, time_s: f64) -> String {
    match frames {
        0 => "no picture is kept".to_owned(),
        1 => "only the first picture is kept".to_owned(),
        _ => format!("only the first {frames} pictures are kept, {time_s:.1} s"),
    }
}

/// Returns a function that adds operation and path to an error.
fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RecordError {
    let path = path.to_owned();
    move |error| RecordError::Io { action, path, error }
}

/// Writer of the files of a recording.
struct Writer {
    colour: ImageList,
    depth: ImageList,
    /// Factor for depth values.
    factor: u16,
}

impl Writer {
    /// Creates the lists and the folders for the images. Depth values are multiplied by `factor`.
    ///
    /// # Errors
    /// Where a file or a folder cannot be created.
    fn create(folder: &Path, factor: u16) -> Result<Self, RecordError> {
        let colour = ImageList::create(folder, "rgb")?;
        Ok(Self { colour, depth: ImageList::create(folder, "depth")?, factor })
    }

    /// Writes frames until the sender is dropped. Returns their number.
    ///
    /// # Errors
    /// [`RecordError::Ended`] where a frame cannot be written; where a list was removed.
    fn run(&mut self, frames: &Receiver<RgbdFrame>) -> Result<u64, RecordError> {
        let mut count = 0;
        let (mut first, mut last) = (None, 0.0);
        for frame in frames {
            let time_s = first.map_or(0.0, |first| last - first);
            self.add(&frame, count + 1).map_err(|error| RecordError::Ended {
                frames: count,
                time_s,
                error: Box::new(error),
            })?;
            count += 1;
            last = frame.time();
            first.get_or_insert(last);
        }
        self.colour.finish()?;
        self.depth.finish()?;
        Ok(count)
    }

    /// Writes the frame of this number.
    fn add(&mut self, frame: &RgbdFrame, number: u64) -> Result<(), RecordError> {
        let depth = raw::multiplied(frame.depth(), self.factor);
        self.colour.add(frame.time(), number, || png::encode_colour(frame.colour()))?;
        self.depth.add(frame.time(), number, || png::encode_depth(&depth))
    }
}

/// List of the colour or depth images, with their folder.
struct ImageList {
    /// Folder of the recording.
    folder: PathBuf,
    /// Name of the list, without extension, and of the folder of its images.
    name: &'static str,
    file: WholeWrites,
}

impl ImageList {
    /// Creates the list and the folder for its images.
    fn create(folder: &Path, name: &'static str) -> Result<Self, RecordError> {
        let images = folder.join(name);
        fs::create_dir(&images).map_err(io_error("create", &images))?;
        let path = folder.join(name).with_extension("txt");
        let file = File::create_new(&path).map_err(io_error("create", &path))?;
        let mut file = WholeWrites::new(file);
        file.write_all(b"# timestamp path\n").map_err(io_error("write", &path))?;
        Ok(Self { folder: folder.to_owned(), name, file })
    }

    /// Writes an image, and then its line in the list: every listed image is complete.
    fn add(
        &mut self,
        time: f64,
        number: u64,
        encode: impl FnOnce() -> Result<Vec<u8>, BoxedError>,
    ) -> Result<(), RecordError> {
        let name = format!("{}/{number:06}.png", self.name);
        let path = self.folder.join(&name);
        let bytes = encode().map_err(|error| RecordError::Encode { path: path.clone(), error })?;
        write_whole(&path, &bytes).map_err(io_error("write", &path))?;
        let line = format!("{time:.6} {name}\n");
        self.file.write_all(line.as_bytes()).map_err(io_error("add a line for", &path))
    }

    /// Checks that the list was not removed.
    fn finish(&self) -> Result<(), RecordError> {
        let path = self.folder.join(self.name).with_extension("txt");
        check_named(self.file.file()).map_err(io_error("keep", &path))
    }
}

#[cfg(test)]
mod tests;
