//! Publishers whose messages have come on a topic, and whether they take turns.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use plumb_frame::clock::HostClock;
use ros2_client::Gid;

/// Number of publishers that are remembered. One more makes the memory begin anew.
const MAX_PUBLISHERS: usize = 1000;

/// Time after its last message for which a publisher counts as a sender.
pub(crate) const RECENT: Duration = Duration::from_secs(1);

/// Publisher whose messages have come.
#[derive(Debug, Clone)]
pub(crate) struct Sender {
    /// Whether it has the topic's type.
    is_right: bool,
    /// Arrival of its first message.
    first: Instant,
    /// Arrival of its last message.
    last: Instant,
    /// Mapping of its time stamps.
    pub(crate) clock: HostClock,
}

/// Publishers whose messages have come on a topic.
#[derive(Debug, Default)]
pub(crate) struct Senders(HashMap<Gid, Sender>);

/// Number of the publishers that send at present.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sending {
    /// One publisher, or none.
    One,
    /// One publisher has begun, and another one has not sent since, but in the last second: the one
    /// that has begun is its successor or a second one.
    Unclear,
    /// So many publishers, which take turns.
    Many(usize),
}

impl Senders {
    /// Returns whether messages of this publisher have come.
    pub(crate) fn has(&self, gid: Gid) -> bool {
        self.0.contains_key(&gid)
    }

    /// Adds the publisher of a message that arrived at `arrival`. Notes whether it `is_right`: has
    /// the topic's type.
    pub(crate) fn add(&mut self, gid: Gid, is_right: bool, arrival: Instant) {
        if self.0.len() >= MAX_PUBLISHERS {
            self.0.clear();
        }
        let clock = HostClock::new(0.0);
        self.0.insert(gid, Sender { is_right, first: arrival, last: arrival, clock });
    }

    /// Notes the arrival of a message. Returns its publisher, if that has the topic's type.
    pub(crate) fn note(&mut self, gid: Gid, arrival: Instant) -> Option<&mut Sender> {
        let sender = self.0.get_mut(&gid)?;
        sender.last = sender.last.max(arrival);
        sender.is_right.then_some(sender)
    }

    /// Returns how many publishers of the topic's type send at present. Publishers take turns if
    /// one has sent before and after the first message of another one.
    pub(crate) fn sending(&self, now: Instant) -> Sending {
        let is_recent = |sender: &&Sender| {
            sender.is_right && now.saturating_duration_since(sender.last) < RECENT
        };
        let recent: Vec<&Sender> = self.0.values().filter(is_recent).collect();
        let takes_turns = |one: &&&Sender| recent.iter().any(|other| one.takes_turns_with(other));
        match recent.iter().filter(takes_turns).count() {
            0 if recent.len() <= 1 => Sending::One,
            0 => Sending::Unclear,
            count => Sending::Many(count),
        }
    }
}

impl Sender {
    /// Returns whether the older one of two publishers has sent since the newer one has begun.
    fn takes_turns_with(&self, other: &Self) -> bool {
        let (older, newer) = if self.first <= other.first { (self, other) } else { (other, self) };
        !std::ptr::eq(self, other) && older.last > newer.first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Publishers that send at times in milliseconds.
    struct Bench {
        senders: Senders,
        begin: Instant,
    }

    impl Bench {
        fn new() -> Self {
            Self { senders: Senders::default(), begin: Instant::now() }
        }

        fn at(&self, milliseconds: u64) -> Instant {
            self.begin + Duration::from_millis(milliseconds)
        }

        /// Publishes a message as the publisher `name`.
        fn send(&mut self, name: u8, milliseconds: u64) {
            let arrival = self.at(milliseconds);
            let gid = Gid::from([name; 16]);
            if !self.senders.has(gid) {
                self.senders.add(gid, name != b'x', arrival);
            }
            self.senders.note(gid, arrival);
        }

        fn sending(&self, milliseconds: u64) -> Sending {
            self.senders.sending(self.at(milliseconds))
        }
    }

    #[test]
    fn publishers_that_take_turns_are_many_until_one_is_silent() {
        let mut bench = Bench::new();
        for k in 0..10 {
            bench.send(b'a', 33 * k);
            assert_eq!(bench.sending(33 * k), Sending::One);
        }
        bench.send(b'b', 310);
        bench.send(b'a', 330);
        assert_eq!(bench.sending(330), Sending::Many(2));
        bench.send(b'c', 340);
        bench.send(b'b', 343);
        assert_eq!(bench.sending(343), Sending::Many(3));
        // The last word of `a` was at 330 ms, that of `c` at 340 ms.
        for k in 0..60 {
            bench.send(b'b', 350 + 33 * k);
        }
        assert_eq!(bench.sending(2300), Sending::One);
    }

    #[test]
    fn a_publisher_that_begins_after_the_last_message_of_another_one_may_be_its_successor() {
        let mut bench = Bench::new();
        for k in 0..10 {
            bench.send(b'a', 33 * k);
        }
        // It has ended, and comes again with another identity.
        for k in 0..20 {
            bench.send(b'b', 400 + 33 * k);
            assert_eq!(bench.sending(400 + 33 * k), Sending::Unclear, "{k}");
        }
        bench.send(b'b', 1300);
        assert_eq!(bench.sending(1300), Sending::One);
        // A second successor, within the second.
        bench.send(b'c', 1400);
        bench.send(b'd', 1500);
        assert_eq!(bench.sending(1500), Sending::Unclear);
        assert_eq!(bench.sending(2450), Sending::One);
    }

    #[test]
    fn a_publisher_of_another_type_does_not_count() {
        let mut bench = Bench::new();
        for k in 0..10 {
            bench.send(b'a', 33 * k);
            bench.send(b'x', 33 * k + 10);
        }
        assert_eq!(bench.sending(330), Sending::One);
    }
}
