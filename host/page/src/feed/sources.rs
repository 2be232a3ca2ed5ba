//! Sources of commands: each open page is one.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use plumb_runtime::operator::OperatorSender;

use crate::subject::ClientId;

/// Senders of the pages' commands.
#[derive(Default)]
pub(super) struct Sources {
    senders: BTreeMap<ClientId, OperatorSender>,
    /// Number of pages so far.
    pages: usize,
}

impl Sources {
    /// Notes a page that was opened from `address`.
    pub(super) fn add(&mut self, client: ClientId, address: SocketAddr, operator: &OperatorSender) {
        self.pages += 1;
        let name = format!("page {} at {}", self.pages, address.ip());
        self.senders.insert(client, operator.source(&name));
    }

    /// Returns the sender of a page's commands.
    pub(super) fn of(&mut self, client: ClientId, operator: &OperatorSender) -> OperatorSender {
        let sender = self.senders.entry(client).or_insert_with(|| operator.source("a page"));
        sender.clone()
    }

    /// Forgets the pages that are gone. A page that still sends, and takes no updates, stays.
    pub(super) fn remove_absent(&mut self, is_present: &dyn Fn(ClientId) -> bool) {
        self.senders.retain(|client, sender| is_present(*client) || !sender.is_silent());
    }
}
