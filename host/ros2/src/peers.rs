//! Publishers of other nodes on a topic that Plumb reads.
//!
//! The DDS library connects every publisher on a topic, also one of another type. A message of
//! another type can look like a valid one (a vector like a point), so the type of each publisher is
//! checked before its messages are used.

use std::fmt;
use std::time::{Duration, Instant};

use ros2_client::{Gid, MessageInfo};
use rustdds::DomainParticipant;
use rustdds::policy::Reliability;

use crate::message::TypedMessage;
use crate::senders::{Sender, Senders, Sending};

/// Publisher on a topic that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UnusablePublisher {
    /// It has another type.
    OtherType {
        /// Name of the topic.
        topic: String,
        /// Type of the publisher, as `geometry_msgs/msg/PointStamped`.
        found: String,
        /// Type of the topic.
        expected: String,
    },
    /// It sends without repetition, but the topic needs every message.
    BestEffort {
        /// Name of the topic.
        topic: String,
    },
}

impl fmt::Display for UnusablePublisher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherType { topic, found, expected } => {
                write!(f, "a publisher on {topic} has the type {found}, but {expected} is needed")
            }
            Self::BestEffort { topic } => write!(
                f,
                "a publisher on {topic} has the reliability `best effort`, but `reliable` is needed"
            ),
        }
    }
}

impl std::error::Error for UnusablePublisher {}

/// Publishers on one topic.
pub(crate) struct Peers {
    participant: DomainParticipant,
    /// Name of the topic in ROS 2.
    topic: String,
    /// Name of its type in DDS.
    kind: String,
    /// Whether the subscription is reliable, so that it needs reliable publishers.
    is_reliable: bool,
    /// Publishers whose messages have come.
    senders: Senders,
    /// Zero of the senders' clocks.
    begin: Instant,
}

impl Peers {
    /// Returns the publishers on `topic`, whose messages are of the type `M`.
    pub(crate) fn new<M: TypedMessage>(
        participant: &DomainParticipant,
        topic: &str,
        is_reliable: bool,
    ) -> Self {
        let kind = M::type_name().dds_msg_type();
        let (participant, topic) = (participant.clone(), topic.to_owned());
        let (senders, begin) = (Senders::default(), Instant::now());
        Self { participant, topic, kind, is_reliable, senders, begin }
    }

    /// Returns the time at which a message was sent that arrived at `arrival`, both on this
    /// computer's clock; `None` if its sender is not known to send the topic's type. The least
    /// delayed message of a sender counts as sent at its arrival, because the clocks of two
    /// computers differ.
    pub(crate) fn sent(&mut self, info: &MessageInfo, arrival: Instant) -> Option<Instant> {
        let begin = self.begin;
        let sender = self.trusted_sender(info, arrival)?;
        let Some(stamp) = info.source_timestamp() else { return Some(arrival) };
        let stamp = Duration::from_nanos(u64::try_from(stamp.to_nanos()).unwrap_or_default());
        let arrival = arrival.saturating_duration_since(begin).as_secs_f64();
        let sent = sender.clock.taken(stamp.as_secs_f64(), arrival);
        Some(begin + Duration::try_from_secs_f64(sent).unwrap_or_default())
    }

    /// Returns the sender of a message, if it is known to send the topic's type. Notes the arrival.
    fn trusted_sender(&mut self, info: &MessageInfo, arrival: Instant) -> Option<&mut Sender> {
        let gid = info.publisher_gid();
        if !self.senders.has(gid) {
            let is_right = self.has_right_type(gid)?;
            self.senders.add(gid, is_right, arrival);
        }
        self.senders.note(gid, arrival)
    }

    /// Returns whether a publisher has the topic's type; `None` if it is not yet known.
    fn has_right_type(&self, gid: Gid) -> Option<bool> {
        let writers = self.participant.discovered_writers();
        let sender =
            writers.iter().find(|writer| Gid::from(writer.writer_proxy.remote_writer_guid) == gid);
        Some(sender?.publication_topic_data.type_name == self.kind)
    }

    /// Returns the name of the topic.
    pub(crate) fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns how many publishers of the topic's type send at present.
    pub(crate) fn sending(&self) -> Sending {
        self.senders.sending(Instant::now())
    }

    /// Returns the number of publishers on the topic.
    pub(crate) fn count(&self) -> usize {
        let dds_topic = self.dds_topic();
        let writers = self.participant.discovered_writers();
        let names = writers.iter().map(|writer| &writer.publication_topic_data.topic_name);
        names.filter(|name| **name == dds_topic).count()
    }

    /// Returns the name of the topic in DDS.
    fn dds_topic(&self) -> String {
        format!("rt{}", self.topic)
    }

    /// Returns the publishers on the topic that cannot be used.
    pub(crate) fn unusable(&self) -> Vec<UnusablePublisher> {
        let dds_topic = self.dds_topic();
        let writers = self.participant.discovered_writers();
        let on_topic = writers
            .iter()
            .map(|writer| &writer.publication_topic_data)
            .filter(|data| data.topic_name == dds_topic);
        let unusable = on_topic.filter_map(|data| {
            let topic = self.topic.clone();
            if data.type_name != self.kind {
                let (found, expected) = (ros_type(&data.type_name), ros_type(&self.kind));
                return Some(UnusablePublisher::OtherType { topic, found, expected });
            }
            let is_best_effort = data.reliability == Some(Reliability::BestEffort);
            (self.is_reliable && is_best_effort).then_some(UnusablePublisher::BestEffort { topic })
        });
        unusable.collect()
    }
}

/// Returns the name in ROS 2 of a type in DDS.
fn ros_type(dds: &str) -> String {
    let name = dds.replace("::dds_::", "::").replace("::", "/");
    name.strip_suffix('_').unwrap_or(&name).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_has_its_name_of_ros() {
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
        assert_eq!(ros_type("ShapeType"), "ShapeType");
    }
}
