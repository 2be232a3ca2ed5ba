//! The host's port.

use std::io;
use std::time::Duration;

use plumb_protocol::units::Micros;
use plumb_runtime::link::{LinkError, Transport};

use super::Shared;
use crate::kind::Kind;

/// Transport of a host that may die.
pub struct Port {
    world: Shared,
    /// Instant at which the host is killed; later it neither sends nor receives.
    killed: Option<Micros>,
}

impl Port {
    /// Opens the port for a host that is killed at `killed`. What an earlier host left unread is
    /// discarded, as a serial port does.
    pub fn open(world: Shared, killed: Option<Micros>) -> Self {
        world.borrow_mut().arrived.clear();
        Self { world, killed }
    }

    /// Checks that host and port are there.
    fn check(&self) -> Result<(), LinkError> {
        let world = self.world.borrow();
        let now = world.now();
        if self.killed.is_some_and(|killed| killed <= now) {
            return Err(LinkError::Other("the host was killed".into()));
        }
        let is_unplugged =
            |fault: &crate::plan::Fault| fault.kind == Kind::Unplugged && fault.acts(now);
        if world.plan.faults.iter().any(is_unplugged) {
            let source = io::Error::from(io::ErrorKind::NotFound);
            return Err(LinkError::Lost { port: self.name(), source });
        }
        Ok(())
    }
}

impl Transport for Port {
    fn name(&self) -> String {
        "campaign".to_owned()
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.world.borrow().now().0)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.check()?;
        let mut world = self.world.borrow_mut();
        let now = world.now();
        world.to_board.send(now, bytes);
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let end = self.now() + wait;
        loop {
            self.check()?;
            let mut world = self.world.borrow_mut();
            bytes.append(&mut world.arrived);
            if !bytes.is_empty() || Duration::from_micros(world.now().0) >= end {
                return Ok(());
            }
            world.tick();
        }
    }
}
