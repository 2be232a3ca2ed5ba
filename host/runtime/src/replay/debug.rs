//! Images of the detector's stages (`plumb replay --debug`).

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use plumb_cameras::png::{self, PngError};
use plumb_frame::detect::StageImage;
use thiserror::Error;

/// A folder with an image of each stage for each frame: `000042-2-outline.png` is the second stage
/// of frame 42. Frames are numbered from 0, as the rows of the replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DebugFolder {
    path: PathBuf,
}

/// Reasons why the images could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DebugError {
    /// The folder could not be made.
    #[error("cannot make the folder {}", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The folder is not empty.
    #[error("{} is not empty: give another folder", .path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// An image could not be written.
    #[error(transparent)]
    Png(#[from] PngError),
}

impl DebugFolder {
    /// Makes the folder, or takes an empty one.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be made or is not empty.
    pub fn create(path: &Path) -> Result<Self, DebugError> {
        let failed = |source| DebugError::Folder { path: path.to_owned(), source };
        fs::create_dir_all(path).map_err(failed)?;
        if fs::read_dir(path).map_err(failed)?.next().is_some() {
            return Err(DebugError::NotEmpty { path: path.to_owned() });
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Writes the images of one frame.
    pub(super) fn write(&self, number: usize, stages: &[StageImage]) -> Result<(), DebugError> {
        for StageImage { name, image } in stages {
            png::save(&self.path.join(format!("{number:06}-{name}.png")), image)?;
        }
        Ok(())
    }
}
