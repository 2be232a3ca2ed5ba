//! Topic that Plumb reads: its messages and their publishers.

use std::io;
use std::time::Instant;

use ros2_client::{Gid, QosProfile, Subscription};
use rustdds::mio1::{Interest, Registry, Token};
use serde::de::DeserializeOwned;

use crate::error::Ros2Error;
use crate::member::Member;
use crate::message::TypedMessage;
use crate::peers::Peers;
use crate::qos;

/// Largest number of messages of one topic that are taken before the others get their turn.
pub(crate) const MAX_IN_TURN: usize = 100;

/// Topic with the messages that have the right type.
pub(crate) struct Topic<M: 'static> {
    messages: Subscription<M>,
    /// Publishers on the topic.
    pub(crate) peers: Peers,
}

/// Origin of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MessageOrigin {
    /// Publisher.
    pub(crate) publisher: Gid,
    /// When it was sent, on this computer's clock.
    pub(crate) sent: Instant,
}

impl<M: TypedMessage + DeserializeOwned + 'static> Topic<M> {
    /// Subscribes to the topic `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where that is not possible.
    pub(crate) fn new(
        member: &mut Member,
        name: &str,
        qos: &QosProfile,
    ) -> Result<Self, Ros2Error> {
        let messages = member.subscription(name, qos)?;
        let peers = Peers::new::<M>(&member.participant, name, qos::is_reliable(qos));
        Ok(Self { messages, peers })
    }

    /// Wakes the poll of `registry` for each message.
    ///
    /// # Errors
    /// Where the operating system refuses.
    pub(crate) fn register(&mut self, registry: &Registry, token: Token) -> io::Result<()> {
        registry.register(&mut self.messages, token, Interest::READABLE)
    }

    /// Removes the messages that have come, and hands those of the right type to `take`.
    pub(crate) fn receive(&mut self, mut take: impl FnMut(M, MessageOrigin)) {
        for _ in 0..MAX_IN_TURN {
            // A message that cannot be decoded is of another type.
            let Ok(received) = self.messages.take() else { continue };
            let Some((message, info)) = received else { return };
            if let Some(sent) = self.peers.sent(&info) {
                take(message, MessageOrigin { publisher: info.publisher_gid(), sent });
            }
        }
    }
}
