//! Times of the link.

use std::time::Duration;

/// Timeout of a request. A board answers within this time even over a link that loses a quarter of
/// the frames.
pub(super) const ANSWER_TIMEOUT: Duration = Duration::from_millis(1500);

/// A request without an answer is sent again after this: below the shortest deadline for a silent
/// host that is usual, 300 ms.
pub(super) const REPEAT_AFTER: Duration = Duration::from_millis(100);

/// Longest wait of one poll of the port.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Longest time without a message to the board while a run waits for pictures: below every usual
/// deadline for a silent host, and above the time between two pictures of a usual camera.
pub(super) const KEEP_ALIVE: Duration = Duration::from_millis(50);
