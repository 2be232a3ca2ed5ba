//! A program without the outputs for viewers.

use std::path::PathBuf;

use plumb_cameras::record::Overflow;
use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use super::ViewerOptions;
use crate::cli::exit::Failure;
use crate::session::outputs::Output;

/// Reason to refuse the options.
const ABSENT: &str = "this program was built without the outputs for viewers; build it with \
                      cargo build --release -p plumb --features foxglove";

/// Refuses the option `--mcap`.
pub(crate) fn file(_: &str) -> Result<PathBuf, &'static str> {
    Err(ABSENT)
}

/// Refuses the option `--foxglove`.
pub(crate) fn flag(text: &str) -> Result<bool, &'static str> {
    if text == "false" { Ok(false) } else { Err(ABSENT) }
}

impl ViewerOptions {
    /// Starts nothing: the options were refused.
    pub(crate) fn start(
        &self,
        _: &Rig,
        _: &Camera,
        _: Overflow,
    ) -> Result<Option<Box<dyn Output>>, Failure> {
        Ok(None)
    }
}
