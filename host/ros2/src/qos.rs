//! Quality of service of the topics.

use ros2_client::QosProfile;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};

/// Messages of which every one counts, such as requests and diagnostics. A write never waits for a
/// slow reader.
pub(crate) const EVERY_MESSAGE: QosProfile = QosProfile::publisher_default()
    .reliability_reliable(WhenFull::Fail)
    .history(History::KeepLast { depth: 10 });

/// Messages of which the newest one counts, such as positions and targets. Reliable, as the
/// publishers and readers of ROS 2 are where nothing else is chosen.
pub(crate) const NEWEST_MESSAGE: QosProfile = EVERY_MESSAGE.history(History::KeepLast { depth: 1 });

/// A state of which readers that come later get the newest message too.
pub(crate) const LATCHED: QosProfile = NEWEST_MESSAGE.durability(Durability::TransientLocal);

/// Messages without repetition, such as pictures: such a subscription hears publishers that are
/// reliable and those that are best effort.
pub(crate) const UNREPEATED: QosProfile = QosProfile::subscription_default();

/// Targets that move: those of a quarter of a second at 200 Hz.
pub(crate) const MOVING_TARGETS: QosProfile = UNREPEATED.history(History::KeepLast { depth: 50 });

/// Pictures. The depth bounds those in the DDS library's memory.
pub(crate) const PICTURES: QosProfile = UNREPEATED.history(History::KeepLast { depth: 4 });

/// Returns whether every message is repeated until it has come.
pub(crate) fn is_reliable(qos: &QosProfile) -> bool {
    matches!(qos.reliability, Reliability::Reliable { .. })
}
