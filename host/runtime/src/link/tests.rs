use std::cell::Cell;

use super::*;

/// A silent port on a busy machine: [`LOOK`] passes between two looks at its clock.
struct Restless {
    looks: Cell<u32>,
}

/// No divisor of [`REPEAT_AFTER`].
const LOOK: Duration = Duration::from_millis(7);

impl Transport for Restless {
    fn name(&self) -> String {
        "restless".to_owned()
    }

    fn now(&self) -> Duration {
        self.looks.set(self.looks.get() + 1);
        LOOK * self.looks.get()
    }

    fn send(&mut self, _: &[u8]) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, _: &mut Vec<u8>, _: Duration) -> Result<(), LinkError> {
        Ok(())
    }
}

#[test]
fn a_host_that_is_held_up_between_two_looks_at_the_clock_waits_no_longer() {
    let silent = Link::connect(Restless { looks: Cell::new(0) }).err();
    assert!(matches!(silent, Some(LinkError::Silent { .. })), "{silent:?}");
}
