//! Jogs of the pages. A jog lasts while the page that began it is there.

use crate::message::RigView;
use crate::subject::ClientId;

/// Limits of one jog.
#[derive(Debug, Clone, Copy)]
pub(super) struct JogLimits {
    /// Longest distance, full steps.
    distance: f64,
    /// Highest rate, full steps/s.
    rate: f64,
}

impl JogLimits {
    pub(super) fn of(rig: &RigView) -> Self {
        Self { distance: rig.jog_distance, rate: rig.jog_rate }
    }

    /// Checks the distance and the rate of a jog.
    ///
    /// # Errors
    /// A message for the person, with the limits.
    pub(super) fn check(&self, distance: f64, rate: f64) -> Result<(), String> {
        let Self { distance: longest, rate: highest } = self;
        if distance.abs() <= *longest && rate > 0.0 && rate <= *highest {
            return Ok(());
        }
        Err(format!(
            "this jog is refused: a jog is {longest} steps at most in either direction, at a rate \
             above 0 and up to {highest} steps/s (table [jog] of the rig file)"
        ))
    }
}

/// Jogs that may be under way.
#[derive(Default)]
pub(super) struct Jogs(Vec<Jog>);

/// Jog that a page has sent.
struct Jog {
    client: ClientId,
    /// Number of the command.
    number: u64,
}

impl Jogs {
    pub(super) fn add(&mut self, client: ClientId, number: u64) {
        self.0.push(Jog { client, number });
    }

    /// Handles the outcome of the command `number`. The board accepts a command after a jog only if
    /// the motors stand, or if it ends the jog.
    pub(super) fn settle(&mut self, number: u64, is_accepted: bool) {
        self.0.retain(|jog| if is_accepted { jog.number >= number } else { jog.number != number });
    }

    /// Removes the jogs of absent clients. Returns whether there were any.
    pub(super) fn remove_absent(&mut self, is_present: &dyn Fn(ClientId) -> bool) -> bool {
        let before = self.0.len();
        self.0.retain(|jog| is_present(jog.client));
        self.0.len() < before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jog_is_abandoned_by_its_own_client_and_only_while_it_may_last() {
        let mut jogs = Jogs::default();
        jogs.add(7, 1);
        jogs.settle(1, true);
        // Another page's jog is refused while the first one lasts.
        jogs.add(8, 2);
        jogs.settle(2, false);
        assert!(!jogs.remove_absent(&|client| client == 7));
        assert!(jogs.remove_absent(&|client| client == 8));
        assert!(!jogs.remove_absent(&|_| false), "it is abandoned once");
        jogs.add(7, 3);
        jogs.settle(3, true);
        jogs.settle(4, true);
        assert!(!jogs.remove_absent(&|_| false), "a later command has ended it");
    }
}
