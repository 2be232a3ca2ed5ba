//! Files of a recording.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;

use plumb_frame::frame::RgbdFrame;
use plumb_pictures::{png, raw};

use super::error::{RecordError, io_error};
use crate::source::BoxedError;
use plumb_config::whole_writes::{WholeWrites, write_whole};

/// Writer of the files of a recording.
pub(super) struct Writer {
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
    pub(super) fn create(folder: &Path, factor: u16) -> Result<Self, RecordError> {
        let colour = ImageList::create(folder, "rgb")?;
        Ok(Self { colour, depth: ImageList::create(folder, "depth")?, factor })
    }

    /// Writes frames until the sender is dropped. Returns their number.
    ///
    /// # Errors
    /// Where a frame cannot be written. The frames before it are complete.
    pub(super) fn run(&mut self, frames: &Receiver<RgbdFrame>) -> Result<u64, RecordError> {
        let mut count = 0;
        for frame in frames {
            count += 1;
            let depth = raw::multiplied(frame.depth(), self.factor);
            self.colour.add(frame.time(), count, || png::encode_colour(frame.colour()))?;
            self.depth.add(frame.time(), count, || png::encode_depth(&depth))?;
        }
        Ok(count)
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
}
