//! A program without the files of other programs.

use std::path::{Path, PathBuf};

use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use super::ImportOptions;
use crate::cli::exit::{Failure, Work, failed};
use crate::commands::calibrate::output::CameraFile;

/// Reason to refuse the option.
const ABSENT: &str = "this program was built without the calibrations of others; build it with \
                      cargo build --release -p plumb --features import";

/// Refuses the option `--import`.
pub(super) fn file(_: &str) -> Result<PathBuf, String> {
    Err(ABSENT.to_owned())
}

/// Imports nothing: the option was refused.
pub(in super::super) fn prepare(
    _: (&Path, &ImportOptions),
    _: (&Path, &Rig, &Camera),
    _: CameraFile,
    _: (bool, bool),
) -> Result<Work, Failure> {
    Err(failed(ABSENT))
}
