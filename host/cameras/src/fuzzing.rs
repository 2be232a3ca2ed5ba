//! Entrances for the fuzz targets in `tests/fuzz` to parsers that are private otherwise.

use plumb_frame::camera::Intrinsics;

use crate::{http, stream};

/// Reads `bytes` as frames of a [stream](crate::stream), up to their end or the first
/// error, and decodes them. Returns the number of frames without an error.
pub fn stream(bytes: &[u8], intrinsics: Intrinsics) -> u64 {
    stream::decode_all(bytes, intrinsics)
}

/// Reads `bytes` as the reply of a [camera in the network](crate::http). Returns the number of its
/// pictures; 0 where it is refused.
pub fn http(bytes: &[u8]) -> u64 {
    http::count_pictures(bytes).unwrap_or(0)
}
