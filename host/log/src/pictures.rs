//! The first and the last picture of a run, in its folder: what the camera saw, for a person who
//! looks at the run later.

use std::path::Path;
use std::sync::Arc;

use plumb_frame::frame::RgbdFrame;
use plumb_pictures::jpeg;
use plumb_runtime::observer::{FrameRecord, Observer};

use super::RunLogError;
use super::output_dir::write_new;

/// File name of a run's first picture.
pub const FIRST_PICTURE: &str = "first.jpg";

/// File name of a run's last picture.
pub const LAST_PICTURE: &str = "last.jpg";

/// JPEG quality: some 50 kB at 640x480, with no trace of the compression at the ball's edge that a
/// person would see.
const QUALITY: u8 = 90;

/// Observer that keeps the first and the last colour image of a run, two frames in memory.
#[derive(Debug, Clone, Default)]
pub struct RunPictures {
    first: Option<Arc<RgbdFrame>>,
    last: Option<Arc<RgbdFrame>>,
}

impl RunPictures {
    /// Writes `first.jpg` and `last.jpg` into the folder of a run. A run without a frame has none,
    /// a run of one frame has the same twice.
    ///
    /// # Errors
    /// [`RunLogError::Picture`], [`RunLogError::Io`], [`RunLogError::FileExists`]: the first file
    /// that cannot be written. The other is tried all the same.
    pub fn write(&self, folder: &Path) -> Result<(), RunLogError> {
        let all = [(FIRST_PICTURE, &self.first), (LAST_PICTURE, &self.last)];
        let written = all.map(|(name, frame)| match frame {
            Some(frame) => write_picture(&folder.join(name), frame),
            None => Ok(()),
        });
        written.into_iter().collect()
    }
}

fn write_picture(path: &Path, frame: &RgbdFrame) -> Result<(), RunLogError> {
    let bytes = jpeg::encode(frame.colour(), QUALITY)
        .map_err(|source| RunLogError::Picture { path: path.to_owned(), source })?;
    write_new(path, &bytes)
}

impl Observer for RunPictures {
    fn frame(&mut self, record: &FrameRecord) {
        if self.first.is_none() {
            self.first.clone_from(&record.frame);
        }
        self.last.clone_from(&record.frame);
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use plumb_cameras::camera_file;
    use plumb_frame::image::Image;
    use plumb_pictures::decode;

    use super::*;

    /// Returns the record of a frame of one grey level.
    fn record(level: u8) -> FrameRecord {
        let intrinsics = camera_file::paper().unwrap().intrinsics;
        let (colour, depth) = (Image::filled(16, 16, [level; 3]), Image::filled(16, 16, 0));
        let frame = RgbdFrame::new(0.0, colour, depth, intrinsics).unwrap();
        FrameRecord { frame: Some(Arc::new(frame)), ..FrameRecord::default() }
    }

    #[test]
    fn the_first_and_the_last_picture_are_in_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let mut pictures = RunPictures::default();
        pictures.write(folder.path()).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        for level in [20, 120, 220] {
            pictures.frame(&record(level));
        }
        pictures.write(folder.path()).unwrap();
        let level = |name: &str| {
            let bytes = fs::read(folder.path().join(name)).unwrap();
            decode::colour(&bytes).unwrap().channels()[0]
        };
        assert_eq!([level(FIRST_PICTURE), level(LAST_PICTURE)], [20, 220]);
        let again = pictures.write(folder.path());
        assert!(matches!(again, Err(RunLogError::FileExists(_))), "{again:?}");
    }
}
