//! Driver of webcams.

use std::path::Path;

use plumb_config::book::page;
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, DriverListing, FoundCamera, OpenedSource};
use plumb_frame::source::BoxedError;
use thiserror::Error;

use crate::nodes::capture_nodes;
use crate::settings::WebcamSettings;
use crate::source::WebcamSource;

/// Endings of the names of video files, in lower case.
pub const VIDEO_ENDINGS: [&str; 7] = ["avi", "mp4", "m4v", "mkv", "mov", "mpg", "webm"];

/// Refusal of a program that is built without OpenCV's module `videoio`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "this program is built without video files: build one that has them, with `cargo build \
     --release -p plumb --features videoio` in its sources ({})",
    page("webcam")
)]
pub struct NotBuilt;

impl CameraDriver for WebcamSettings {
    fn list(&self) -> DriverListing {
        let cameras = capture_nodes().into_iter().map(|node| FoundCamera {
            uri: node.stable.display().to_string(),
            name: format!("{} (webcam)", node.name),
        });
        DriverListing { cameras: cameras.collect(), ..DriverListing::default() }
    }

    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let source = WebcamSource::open(self, camera)?;
        let webcam = source.webcam();
        let description = Some(format!("{}, {}", webcam.path().display(), webcam.mode()));
        let (notes, intrinsics) = (webcam.notes().to_vec(), *source.intrinsics());
        Ok(OpenedSource { description, notes, ..OpenedSource::new(source, intrinsics) })
    }
}
