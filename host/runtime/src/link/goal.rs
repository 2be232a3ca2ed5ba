//! Targets and paths that a run asks the board for.

use plumb_protocol::message::Reference;

use super::destination::Kind;
use super::*;

impl<T: Transport> Link<T> {
    /// Requests a target, in the rig frame, without waiting: [`poll`](Self::poll) repeats the
    /// request until the board has accepted it, and fails where it refuses. Until then
    /// [`target_telemetry`](Self::target_telemetry) is `None`.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn request_target(&mut self, target: Point) -> Result<(), LinkError> {
        let goal = self.begin_goal();
        let id = self.post_awaited(Command::Target(target), Purpose::Target, Some(goal))?;
        debug!(id, "requesting a target");
        let mut destination = Destination::new(goal, Kind::Target);
        destination.push(id);
        self.destination = Some(destination);
        Ok(())
    }

    /// Sets the target, in the rig frame, and waits until the board has accepted it.
    ///
    /// # Errors
    /// Where the board refuses it or has stopped by itself, or the link fails.
    pub fn set_target(&mut self, target: Point) -> Result<(), LinkError> {
        self.request_target(target)?;
        while self.commands.has(Purpose::Target) {
            self.listen(POLL_INTERVAL)?;
            self.poll()?;
        }
        match self.destination.as_ref().and_then(|destination| destination.refusal) {
            Some(Refusal::Faulted(fault)) => Err(LinkError::Fault(fault)),
            _ => self.check_destination(),
        }
    }

    /// Sends the part of a path that comes next, without waiting. The first part replaces the
    /// present target. [`poll`](Self::poll) fails where the board refuses the path, or answers none
    /// of its parts. The parts get numbers that grow.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn follow(&mut self, reference: Reference) -> Result<(), LinkError> {
        self.references = self.references.wrapping_add(1);
        let reference = Reference { sequence: self.references, ..reference };
        if !self.destination.as_ref().is_some_and(Destination::is_path) {
            let goal = self.begin_goal();
            self.destination = Some(Destination::new(goal, Kind::Path));
        }
        let goal = self.goal;
        let id = self.post_awaited(Command::Follow(reference), Purpose::Path, Some(goal))?;
        if let Some(path) = &mut self.destination {
            path.push(id);
        }
        Ok(())
    }

    /// Gives up the path that was sent: the next part begins another one.
    pub fn leave_path(&mut self) {
        if self.destination.as_ref().is_some_and(Destination::is_path) {
            self.leave_destination();
        }
    }

    /// Gives up the target or the path: none of its commands is sent again.
    pub(super) fn leave_destination(&mut self) {
        if let Some(left) = self.destination.take() {
            self.commands.end_goal(left.goal);
        }
    }

    /// Ends the present goal. Returns the number of the next one.
    fn begin_goal(&mut self) -> GoalNumber {
        self.leave_destination();
        self.goal = self.goal.next();
        self.goal
    }

    /// Notes that the motion of the newest part comes to rest at another place than those of the
    /// parts before.
    pub fn note_new_rest(&mut self) {
        if let Some(destination) = &mut self.destination {
            destination.same_rest = 1;
        }
    }

    /// Returns the newest telemetry if it is about the target or the path asked for last.
    pub fn target_telemetry(&self) -> Option<&Telemetry> {
        let destination = self.destination.as_ref()?;
        self.telemetry().filter(|it| it.target.is_some_and(|id| destination.has(id)))
    }

    /// Returns the newest telemetry if it is about the path that was sent last.
    pub fn path_telemetry(&self) -> Option<&Telemetry> {
        self.target_telemetry().filter(|_| self.destination.as_ref().is_some_and(|it| it.is_path()))
    }

    /// Returns the newest telemetry if it is about a part whose motion comes to rest where that of
    /// the newest one does. Other telemetry says nothing about the ball at that place.
    pub fn rest_telemetry(&self) -> Option<&Telemetry> {
        let path = self.destination.as_ref().filter(|destination| destination.is_path())?;
        self.telemetry().filter(|it| it.target.is_some_and(|id| path.has_same_rest(id)))
    }

    /// Takes in the board's answer to a command of the destination: `refusal` where it refuses.
    pub(super) fn note_destination_answer(&mut self, refusal: Option<Refusal>) {
        let Some(destination) = &mut self.destination else { return };
        match refusal {
            None => destination.is_accepted = true,
            // A newer part was faster.
            Some(Refusal::ReferenceOutOfOrder) if destination.is_path() => {}
            Some(Refusal::Faulted(_)) if destination.is_path() => {}
            // Somebody's jog is under way. A later part begins the path when the motor stands.
            Some(Refusal::Busy(State::Jogging)) if destination.is_path() => {}
            Some(refusal) => {
                destination.refusal.get_or_insert(refusal);
            }
        }
        if let Some(Refusal::Faulted(fault)) = refusal {
            self.note_fault(fault);
        }
    }

    /// Takes in telemetry: where it names a command of the destination, the board has accepted it.
    pub(super) fn note_destination_telemetry(&mut self, telemetry: &Telemetry) {
        let Some(destination) = &mut self.destination else { return };
        let Some(id) = telemetry.target.filter(|id| destination.has(*id)) else { return };
        destination.is_accepted = true;
        if !destination.is_path() {
            destination.refusal = None;
            self.commands.take(id);
        }
    }

    /// Notes that the board drives to the target of the command `id`, or holds the ball by it.
    pub(super) fn note_new_target(&mut self, id: u16) {
        let goal = self.begin_goal();
        let mut destination = Destination::new(goal, Kind::Target);
        destination.push(id);
        destination.is_accepted = true;
        self.destination = Some(destination);
    }

    /// Returns whether the board has accepted the target or the path.
    pub(super) fn is_destination_accepted(&self) -> bool {
        self.destination.as_ref().is_some_and(|destination| destination.is_accepted)
    }

    /// Checks that the board has not refused the target or the path.
    pub(super) fn check_destination(&self) -> Result<(), LinkError> {
        let Some(destination) = &self.destination else { return Ok(()) };
        let what = if destination.is_path() { Purpose::Path } else { Purpose::Target }.name();
        match destination.refusal {
            // The fault is the cause, and is reported as such.
            Some(_) if self.fault.is_some() && destination.is_path() => Ok(()),
            Some(Refusal::Faulted(_)) if self.fault.is_some() => Ok(()),
            Some(refusal) => Err(LinkError::Refused { what, refusal }),
            None => Ok(()),
        }
    }
}
