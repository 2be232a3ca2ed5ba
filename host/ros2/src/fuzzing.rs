//! Entrances for the fuzz targets in `tests/fuzz` to the messages of other nodes.

use plumb_cameras::ros2::Ros2CameraSettings;
use serde::de::DeserializeOwned;

use crate::camera::lens;
use crate::camera::picture::{self, Picture};
use crate::message::from_cdr;
use crate::message::sensor::{CameraInfo, CompressedImage, Image};

/// Topic in the messages of errors.
const TOPIC: &str = "/camera";

/// Reads the CDR of a message in either byte order; `None` where it is none.
fn read<M: DeserializeOwned>(bytes: &[u8]) -> Option<M> {
    let (first, bytes) = bytes.split_first()?;
    from_cdr(bytes, first % 2 == 0)
}

/// Reads `bytes` as each message of a camera, and decodes it. The first byte chooses the byte
/// order. Returns whether one was decoded.
pub fn camera(bytes: &[u8]) -> bool {
    let raw = read::<Image>(bytes);
    let file = read::<CompressedImage>(bytes);
    let pictures = [raw.map(Picture::Raw), file.map(Picture::Compressed)];
    let pictured = pictures.iter().flatten().fold(false, |any, picture| {
        // Both, whatever the first one returns.
        let decoded = [picture.colour(TOPIC).is_ok(), picture.depth(TOPIC).is_ok()];
        any || decoded.contains(&true)
    });
    let described = read::<CameraInfo>(bytes).is_some_and(|info| {
        let Some(size) = lens::picture_size(&info) else { return false };
        // A picture of this size was decoded before.
        let is_possible = size.width.max(size.height) <= picture::MAX_SIDE as usize;
        let settings = Ros2CameraSettings::default();
        is_possible && lens::intrinsics(&info, size, picture::DEPTH_SCALE, &settings).is_ok()
    });
    pictured || described
}
