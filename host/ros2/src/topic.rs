//! Topic that Plumb reads: its messages and their publishers.

use std::io;
use std::time::{Duration, Instant};

use plumb_runtime::wall_clock;
use ros2_client::{Gid, MessageInfo, QosProfile, Subscription};
use rustdds::mio1::{Interest, Registry, Token};
use serde::de::DeserializeOwned;

use crate::error::Ros2Error;
use crate::message::TypedMessage;
use crate::network::Member;
use crate::peers::Peers;
use crate::qos;

/// Longest time for which a message waits in the DDS library. One that seems to have waited longer
/// came before the wall clock was set.
const MAX_WAIT: Duration = Duration::from_secs(1);

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
    /// When it arrived.
    pub(crate) arrival: Instant,
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
            let arrival = arrival(&info);
            if let Some(sent) = self.peers.sent(&info, arrival) {
                let publisher = info.publisher_gid();
                take(message, MessageOrigin { publisher, sent, arrival });
            }
        }
    }
}

/// Returns the time at which the DDS library had a message as a whole. The library tells it on the
/// wall clock.
pub(crate) fn arrival(info: &MessageInfo) -> Instant {
    // In this order an interruption in between makes the arrival late, as one before both does. An
    // early one would count as that of the fastest message.
    let (wall, now) = (wall_clock::now(), Instant::now());
    let received = info.received_timestamp().and_then(|it| u64::try_from(it.to_nanos()).ok());
    let waited = received.map_or(Duration::ZERO, |received| waited(received, wall));
    now.checked_sub(waited).unwrap_or(now)
}

/// Returns for how long a message has waited at `now` that was `received` before, both in
/// nanoseconds on the wall clock.
fn waited(received: u64, now: u64) -> Duration {
    let waited = Duration::from_nanos(now.saturating_sub(received));
    if waited <= MAX_WAIT { waited } else { Duration::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_clock_that_was_set_makes_no_arrival_earlier() {
        let now = 1_800_000_000_000_000_000;
        assert_eq!(waited(now - 30_000_000, now), Duration::from_millis(30));
        assert_eq!(waited(now + 3_600_000_000_000, now), Duration::ZERO);
        assert_eq!(waited(now - 3_600_000_000_000, now), Duration::ZERO);
    }
}
