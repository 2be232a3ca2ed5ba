//! A program without the outputs for viewers.

use plumb_cameras::record::Overflow;
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::Rig;
use plumb_vision::camera::Camera;

use super::super::{Failure, failed};
use super::ViewerOptions;

/// Reason to refuse the options.
const ABSENT: &str = "this program was built without the outputs for viewers; build it with \
                      cargo build --release -p plumb --features foxglove";

/// Observer without effect.
pub(in super::super) struct Viewers;

impl ViewerOptions {
    /// Refuses the options.
    pub(in super::super) fn start(
        &self,
        _: &Rig,
        _: &Camera,
        _: Overflow,
    ) -> Result<Viewers, Failure> {
        match self.mcap.is_some() || self.foxglove {
            true => Err(failed(ABSENT)),
            false => Ok(Viewers),
        }
    }
}

/// Closes nothing.
pub(in super::super) fn close(_: Viewers) -> Result<(), Failure> {
    Ok(())
}

impl Observer for Viewers {
    fn frame(&mut self, _: &FrameRecord) {}
}
