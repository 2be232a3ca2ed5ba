//! Sources of targets: each publisher is one.

use std::collections::HashMap;

use plumb_runtime::operator::OperatorSender;
use ros2_client::Gid;

/// Number of publishers above which those that are silent are forgotten.
const MANY: usize = 64;

/// Senders of the publishers' targets.
#[derive(Debug)]
pub(super) struct Sources {
    operator: OperatorSender,
    senders: HashMap<Gid, OperatorSender>,
}

impl Sources {
    /// Returns the sources of targets for the run of `operator`.
    pub(super) fn new(operator: OperatorSender) -> Self {
        Self { operator, senders: HashMap::new() }
    }

    /// Returns the sender of a publisher's targets. `topic` names it for people.
    pub(super) fn of(&mut self, publisher: Gid, topic: &str) -> OperatorSender {
        if self.senders.len() > MANY {
            // A silent publisher begins anew anyway.
            self.senders.retain(|_, sender| !sender.is_silent());
        }
        let new = || self.operator.source(&format!("a publisher on {topic}"));
        self.senders.entry(publisher).or_insert_with(new).clone()
    }
}

#[cfg(test)]
mod tests {
    use plumb_runtime::operator::{OperatorCommand, operator};

    use super::*;

    #[test]
    fn silent_publishers_are_forgotten_and_those_that_send_are_not() {
        let (operator, _receiver) = operator();
        let mut sources = Sources::new(operator);
        let gid = |k: u8| Gid::from([k; 16]);
        for k in 0..5 {
            sources.of(gid(k), "/plumb/target").send(OperatorCommand::Hold).unwrap();
        }
        for k in 5..=255 {
            let _silent = sources.of(gid(k), "/plumb/target");
        }
        assert!(sources.senders.len() <= MANY + 1, "{}", sources.senders.len());
        assert!((0..5).all(|k| sources.senders.contains_key(&gid(k))));
    }
}
