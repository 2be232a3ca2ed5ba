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

/// A silent port whose reads take a time of their own, whatever wait they are asked for.
struct Uneven<'a> {
    now: &'a Cell<Duration>,
    read: Duration,
}

impl Transport for Uneven<'_> {
    fn name(&self) -> String {
        "uneven".to_owned()
    }

    fn now(&self) -> Duration {
        self.now.get()
    }

    fn send(&mut self, _: &[u8]) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, _: &mut Vec<u8>, _: Duration) -> Result<(), LinkError> {
        self.now.set(self.now.get() + self.read);
        Ok(())
    }
}

#[test]
fn a_timeout_is_a_time_however_long_a_read_takes() {
    for read in [1, 7, 100, 800].map(Duration::from_millis) {
        let now = Cell::default();
        let silent = Link::connect(Uneven { now: &now, read }).err();
        assert!(matches!(silent, Some(LinkError::Silent { .. })), "{silent:?}");
        let waited = now.get();
        let allowed = ANSWER_TIMEOUT..=ANSWER_TIMEOUT + read;
        assert!(allowed.contains(&waited), "reads of {read:?}: given up after {waited:?}");
    }
}
