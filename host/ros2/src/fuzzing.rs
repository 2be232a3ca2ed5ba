//! Entrances for the fuzz targets in `tests/fuzz` to the messages and packets of other nodes.

use std::time::{Duration, Instant};

use plumb_cameras::ros2::Ros2CameraSettings;
use serde::de::DeserializeOwned;

use crate::camera::lens;
use crate::camera::picture::{self, Picture};
use crate::gate::Guard;
use crate::message::from_cdr;
use crate::message::sensor::{CameraInfo, CompressedImage, Image};

/// Most bytes of a sample in packets.
const MAX_SAMPLE: u32 = 1 << 20;

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

/// Judges packets, each a second after the one before; two bytes before each have its length.
/// Returns the number of those that the DDS library would see, and the bytes that are claimed, as a
/// share of those that may be.
pub fn packets(mut bytes: &[u8]) -> (usize, f64) {
    let (mut guard, mut now, mut admitted) = (Guard::new(MAX_SAMPLE), Instant::now(), 0);
    while let Some((length, rest)) = bytes.split_first_chunk() {
        let length = usize::from(u16::from_le_bytes(*length)).min(rest.len());
        let (packet, rest) = rest.split_at(length);
        admitted += usize::from(guard.admit(packet, now).is_ok());
        (bytes, now) = (rest, now + Duration::from_secs(1));
    }
    (admitted, guard.claimed() as f64 / (2.0 * f64::from(MAX_SAMPLE)))
}
