//! Limits of a camera in the network, which errors name.

use std::time::Duration;

/// Longest wait for a connection, for a reply, and for each whole picture.
pub(super) const PATIENCE: Duration = Duration::from_secs(3);

/// Most bytes of a picture.
pub(super) const MAX_PICTURE_BYTES: u64 = 16 << 20;
