//! Gestures of the pages that move the target.

use plumb_runtime::targets::MotionId;

use crate::message::Gesture;
use crate::subject::ClientId;

/// Motions of the pages' last gestures.
#[derive(Default)]
pub(super) struct Gestures(Vec<(ClientId, MotionId)>);

impl Gestures {
    /// Returns the motion that a message of `client` belongs to. `begin` begins one.
    ///
    /// # Errors
    /// A message for the person, where the gesture was not begun.
    pub(super) fn motion(
        &mut self,
        gesture: Gesture,
        client: ClientId,
        begin: impl FnOnce() -> MotionId,
    ) -> Result<MotionId, String> {
        if gesture == Gesture::Begins {
            self.0.retain(|(of, _)| *of != client);
            self.0.push((client, begin()));
        }
        let found = self.0.iter().find(|(of, _)| *of == client);
        let unknown = || "this `move` belongs to no gesture: begin one with `first`".to_owned();
        found.map(|(_, motion)| *motion).ok_or_else(unknown)
    }

    /// Forgets the gestures of absent clients.
    pub(super) fn remove_absent(&mut self, is_present: &dyn Fn(ClientId) -> bool) {
        self.0.retain(|(client, _)| is_present(*client));
    }
}
