//! Recording a run's pictures as a TUM RGB-D folder, which `plumb replay` reads back to the same
//! detections.
//!
//! Beside `rgb.txt`, `depth.txt` and the PNGs the folder holds the camera file of the run with the
//! intrinsics that were used. Depth is written at 5000 units a metre, as the format has it,
//! wherever that keeps every value.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use opencv::core::{Mat, Vec3b, Vector};
use opencv::imgcodecs::{IMWRITE_PNG_COMPRESSION, imencode};
use plumb_vision::camera::Intrinsics;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::DepthImage;
use thiserror::Error;

/// The camera file in a recording.
pub const CAMERA_FILE: &str = "camera.toml";

/// Depth units a metre of TUM RGB-D.
const TUM_SCALE: f64 = 5000.0;

/// Frames that may wait to be written: 2 s at 30 Hz, 100 MB at 640x480.
const WAITING: usize = 64;

/// zlib's least: a tenth of its usual time for half as much again of file.
const COMPRESSION: i32 = 1;

/// What to do when pictures come faster than they can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overflow {
    /// Leave some out, and count them: a run does not wait for a disk.
    Drop,
    /// Wait: in virtual time nobody is late.
    Block,
}

/// Why there is no recording, or an incomplete one.
#[derive(Debug, Error)]
pub enum RecordError {
    /// There is something already.
    #[error("{} exists already and is not an empty folder: recordings are never overwritten; give another folder or move it away", .0.display())]
    Exists(PathBuf),
    /// The file system refused.
    #[error("the recording: cannot {action} {}: {error}", .path.display())]
    Io {
        /// What was to be done.
        action: &'static str,
        /// To what.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// The camera file cannot be written with other intrinsics.
    #[error("the recording: the camera file: {0}")]
    Camera(String),
    /// OpenCV refused.
    #[error("the recording: OpenCV: {0}")]
    OpenCv(#[from] opencv::Error),
    /// The thread that writes ended otherwise.
    #[error("the recording's thread broke down")]
    Thread,
}

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// The folder.
    pub folder: PathBuf,
    /// Frames in it.
    pub frames: u64,
    /// Frames that were left out, because they came faster than they could be written.
    pub left_out: u64,
}

/// A new folder for a recording.
#[derive(Debug)]
pub struct RecordFolder(PathBuf);

/// Writes frames in a thread of its own.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    overflow: Overflow,
    frames: SyncSender<RgbdFrame>,
    writer: JoinHandle<Result<u64, RecordError>>,
    left_out: u64,
}

fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RecordError {
    let path = path.to_owned();
    move |error| RecordError::Io { action, path, error }
}

impl RecordFolder {
    /// Makes the folder `path`, and those above it.
    ///
    /// # Errors
    /// [`RecordError::Exists`] where there is something that is no empty folder; where it cannot be
    /// made.
    pub fn create(path: &Path) -> Result<Self, RecordError> {
        if path.symlink_metadata().is_ok_and(|data| !data.is_dir()) {
            return Err(RecordError::Exists(path.to_owned()));
        }
        fs::create_dir_all(path).map_err(io("create", path))?;
        let mut entries = fs::read_dir(path).map_err(io("look into", path))?;
        if entries.next().is_some() {
            return Err(RecordError::Exists(path.to_owned()));
        }
        Ok(Self(path.to_owned()))
    }

    /// Where a device's own recording goes.
    pub fn oni(&self) -> PathBuf {
        self.0.join("recording.oni")
    }

    /// Begins to record frames of `intrinsics`, taken by the camera that `camera` describes (the
    /// text of its file).
    ///
    /// # Errors
    /// Where a file cannot be made.
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
        fs::write(&path, described).map_err(io("write", &path))?;
        let mut writer = Writer::create(&folder, factor)?;
        let (frames, incoming) = sync_channel(WAITING);
        let thread = thread::Builder::new().name("recorder".to_owned());
        let writer = thread
            .spawn(move || writer.run(&incoming))
            .map_err(io("begin to write to", &folder))?;
        Ok(Recorder { folder, overflow, frames, writer, left_out: 0 })
    }
}

impl Recorder {
    /// Records a frame, as soon as may be.
    pub fn add(&mut self, frame: &RgbdFrame) {
        // A writer that has ended says why at the end.
        self.left_out += match self.overflow {
            Overflow::Block => u64::from(self.frames.send(frame.clone()).is_err()),
            Overflow::Drop => match self.frames.try_send(frame.clone()) {
                Ok(()) => 0,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => 1,
            },
        };
    }

    /// Writes what waits, and ends.
    ///
    /// # Errors
    /// Where something could not be written; what was before it is complete.
    pub fn finish(self) -> Result<Recording, RecordError> {
        drop(self.frames);
        let frames = self.writer.join().map_err(|_| RecordError::Thread)??;
        Ok(Recording { folder: self.folder, frames, left_out: self.left_out })
    }
}

/// What depth is multiplied by, and its units a metre then: the format's where that is a whole
/// factor.
fn scale(own: f64) -> (u16, f64) {
    let factor = (TUM_SCALE / own).round();
    if (1.0..=1000.0).contains(&factor) && factor * own == TUM_SCALE {
        (factor as u16, TUM_SCALE)
    } else {
        (1, own)
    }
}

/// The camera file `text` with other intrinsics.
fn camera_file(text: &str, intrinsics: &Intrinsics) -> Result<String, RecordError> {
    let mut table: toml::Table = text
        .parse()
        .map_err(|error: toml::de::Error| RecordError::Camera(error.message().to_owned()))?;
    let Intrinsics { fx, fy, cx, cy, depth_scale } = *intrinsics;
    let entries = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy), ("depth_scale", depth_scale)];
    let lens: toml::Table =
        entries.map(|(key, value)| (key.to_owned(), value.into())).into_iter().collect();
    table.insert("intrinsics".to_owned(), lens.into());
    toml::to_string(&table).map_err(|error| RecordError::Camera(error.to_string()))
}

/// The files of a recording that is going on.
struct Writer {
    folder: PathBuf,
    lists: [File; 2],
    factor: u16,
    frames: u64,
}

impl Writer {
    fn create(folder: &Path, factor: u16) -> Result<Self, RecordError> {
        let list = |name: &str, kind: &str| -> Result<File, RecordError> {
            let pictures = folder.join(kind);
            fs::create_dir(&pictures).map_err(io("create", &pictures))?;
            let path = folder.join(name);
            let mut file = File::create_new(&path).map_err(io("create", &path))?;
            writeln!(file, "# timestamp path").map_err(io("write", &path))?;
            Ok(file)
        };
        let lists = [list("rgb.txt", "rgb")?, list("depth.txt", "depth")?];
        Ok(Self { folder: folder.to_owned(), lists, factor, frames: 0 })
    }

    fn run(&mut self, frames: &Receiver<RgbdFrame>) -> Result<u64, RecordError> {
        for frame in frames {
            self.write(&frame)?;
            self.frames += 1;
        }
        Ok(self.frames)
    }

    /// Writes both pictures, and then names them in the lists: what is named is whole.
    fn write(&mut self, frame: &RgbdFrame) -> Result<(), RecordError> {
        let depth = multiplied(frame.depth(), self.factor);
        let [rows, columns] = [depth.height() as i32, depth.width() as i32];
        let bytes = frame.colour().channels();
        let colour = Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, bytes)?;
        let depth = Mat::new_rows_cols_with_data(rows, columns, depth.pixels())?;
        for (kind, picture, list) in [("rgb", &colour, 0), ("depth", &depth, 1)] {
            let name = format!("{kind}/{:06}.png", self.frames + 1);
            let mut bytes = Vector::<u8>::new();
            let options = Vector::from_slice(&[IMWRITE_PNG_COMPRESSION, COMPRESSION]);
            imencode(".png", picture, &mut bytes, &options)?;
            let path = self.folder.join(&name);
            fs::write(&path, bytes.as_slice()).map_err(io("write", &path))?;
            let line = format!("{:.6} {name}\n", frame.time());
            let Some(file) = self.lists.get_mut(list) else { continue };
            file.write_all(line.as_bytes()).map_err(io("add a line for", &path))?;
        }
        Ok(())
    }
}

/// `depth` in units of which there are `factor` times as many; none (0) where that is out of range:
/// beyond 13.1 m.
fn multiplied(depth: &DepthImage, factor: u16) -> DepthImage {
    let mut depth = depth.clone();
    if factor != 1 {
        for value in depth.pixels_mut() {
            *value = value.checked_mul(factor).unwrap_or(0);
        }
    }
    depth
}

#[cfg(test)]
mod tests;
