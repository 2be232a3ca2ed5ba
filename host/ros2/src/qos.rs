//! Quality of service of the topics.

use ros2_client::QosProfile;
use ros2_client::qos::{History, WhenFull};

/// Messages of which every one counts, such as requests and diagnostics. A write never waits for a
/// slow reader.
pub(crate) const EVERY_MESSAGE: QosProfile = QosProfile::publisher_default()
    .reliability_reliable(WhenFull::Fail)
    .history(History::KeepLast { depth: 10 });

/// Messages of which the newest one counts, such as positions and targets. Reliable, as the
/// publishers and readers of ROS 2 are where nothing else is chosen.
pub(crate) const NEWEST_MESSAGE: QosProfile = EVERY_MESSAGE.history(History::KeepLast { depth: 1 });
