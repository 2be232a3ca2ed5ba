//! What the targets of recordings share.

use plumb_cameras::camera_file;
use plumb_frame::camera::Intrinsics;
use plumb_frame::source::CameraSource;

/// Returns intrinsics of pictures whose middle is this column and row: those with another principal
/// point are those of another size.
pub(crate) fn intrinsics((cx, cy): (f64, f64)) -> Option<Intrinsics> {
    Some(Intrinsics { cx, cy, ..camera_file::paper().ok()?.intrinsics })
}

/// Reads every frame of a recording, each of which is a frame or an error. Returns the number of
/// those without an error.
pub(crate) fn whole_frames(mut recording: impl CameraSource) -> usize {
    std::iter::from_fn(|| recording.next_frame().transpose()).filter(Result::is_ok).count()
}
