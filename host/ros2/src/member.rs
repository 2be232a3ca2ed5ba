//! Node of ROS 2 with its topics.

use ros2_client::{Name, Node, Publisher, QosProfile, Subscription};
use rustdds::DomainParticipant;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::Ros2Error;
use crate::interruption;
use crate::message::TypedMessage;

/// Node that has joined a domain.
pub(crate) struct Member {
    pub(crate) node: Node,
    pub(crate) participant: DomainParticipant,
    /// Number of interruptions of the program before it joined.
    pub(crate) interruptions: u64,
}

impl Member {
    /// Returns whether the DDS library still runs, as far as is known: an
    /// [`interruption`](crate::interruption) ends its threads.
    pub(crate) fn is_alive(&self) -> bool {
        // The second question goes to one of the threads, and fails once that has ended.
        !self.was_interrupted() && self.participant.assert_liveliness().is_ok()
    }

    /// Returns whether the program was interrupted since the node has joined.
    pub(crate) fn was_interrupted(&self) -> bool {
        interruption::count() != self.interruptions
    }

    /// Creates a publisher on the topic `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where it cannot be created.
    pub(crate) fn publisher<M: TypedMessage + Serialize>(
        &mut self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<Publisher<M>, Ros2Error> {
        let topic = self.topic::<M>(name, qos)?;
        self.node
            .create_publisher(&topic, None)
            .map_err(|source| Ros2Error::Endpoint { name: name.to_owned(), source: source.into() })
    }

    /// Creates a subscription to the topic `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where it cannot be created.
    pub(crate) fn subscription<M: TypedMessage + DeserializeOwned + 'static>(
        &mut self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<Subscription<M>, Ros2Error> {
        let topic = self.topic::<M>(name, qos)?;
        self.node
            .create_subscription(&topic, None)
            .map_err(|source| Ros2Error::Endpoint { name: name.to_owned(), source: source.into() })
    }

    fn topic<M: TypedMessage>(
        &self,
        name: &str,
        qos: &QosProfile,
    ) -> Result<rustdds::Topic, Ros2Error> {
        let parsed = Name::parse(name).map_err(|source| Ros2Error::Endpoint {
            name: name.to_owned(),
            source: source.into(),
        })?;
        self.node
            .create_topic(&parsed, M::type_name(), qos)
            .map_err(|source| Ros2Error::Endpoint { name: name.to_owned(), source: source.into() })
    }
}
