//! Topics and services of a rig's node.

use std::io;

use rustdds::mio1::{Registry, Token};

use crate::Ros2Settings;
use crate::action::Action;
use crate::error::Ros2Error;
use crate::network::Member;
use crate::publishers::Publishers;
use crate::service::Service;
use crate::targets::TargetTopics;

/// Most bytes of a message: what ROS 2 says about the nodes of a large program has some hundred
/// thousand, a target or a request some hundred.
const MAX_MESSAGE: u32 = 1 << 20;

/// Tokens of set points and of targets that move.
const TARGETS: [Token; 2] = [Token(1), Token(2)];
/// Token of the first service.
const FIRST_SERVICE: usize = 3;

/// Topics and services of a rig's node.
pub(crate) struct Endpoints {
    pub(crate) targets: TargetTopics,
    /// Services in the order of [`Action::ALL`].
    pub(crate) services: Vec<Service>,
    pub(crate) publishers: Publishers,
    member: Member,
}

impl Endpoints {
    /// Joins ROS 2 with a node. What comes wakes the poll of `registry`, with tokens from 1 on.
    ///
    /// # Errors
    /// As [`Network`](crate::Network) says, and where the operating system refuses.
    pub(crate) fn join(settings: &Ros2Settings, registry: &Registry) -> Result<Self, Ros2Error> {
        let Ros2Settings { namespace, network, camera } = settings;
        let mut member = network.join(namespace, "plumb", MAX_MESSAGE)?;
        let publishers = Publishers::new(&mut member, namespace, *camera)?;
        let targets = TargetTopics::new(&mut member, namespace)?;
        let names = Action::ALL.map(|action| namespace.topic(action.name()));
        let services = names.iter().map(|name| Service::new(&mut member, name));
        let services = services.collect::<Result<_, _>>()?;
        let mut endpoints = Self { targets, services, publishers, member };
        endpoints.register(registry).map_err(Ros2Error::Thread)?;
        Ok(endpoints)
    }

    /// Returns whether the node is still in ROS 2.
    pub(crate) fn is_alive(&self) -> bool {
        self.member.is_alive()
    }

    /// Returns whether the program was interrupted since the node has joined.
    pub(crate) fn was_interrupted(&self) -> bool {
        self.member.was_interrupted()
    }

    /// Registers everything that wakes the thread.
    fn register(&mut self, registry: &Registry) -> io::Result<()> {
        self.targets.register(registry, TARGETS)?;
        for (index, service) in self.services.iter_mut().enumerate() {
            service.register(registry, Token(FIRST_SERVICE + index))?;
        }
        Ok(())
    }
}
