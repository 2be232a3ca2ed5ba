//! The table of commands that wait for their answers: one place repeats them and gives them up.
//!
//! The board carries out a command once, and answers each repetition of it ([`plumb_protocol`],
//! order, loss and duplicates). So a command is repeated with its id until its answer comes. A part
//! of a path is not repeated: the next one replaces it.
//!
//! A command may belong to a goal: a target or a path that the board was asked for. Once the goal
//! has ended, its commands leave the table, so none of them is sent again, and their answers
//! change nothing.

use std::time::Duration;

use plumb_protocol::message::Command;

use super::timing::{ANSWER_TIMEOUT, REPEAT_AFTER};

/// Number of a goal of this link, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct GoalNumber(u64);

impl GoalNumber {
    /// Returns the number of the next goal.
    pub(super) fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }
}

/// Sender of a command, which decides about its repetition and its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A function that waits for the answer.
    Request {
        /// Name of the command for people.
        name: &'static str,
        /// Time for the answer.
        timeout: Duration,
    },
    /// A target.
    Target,
    /// A part of a path.
    Path,
    /// A command of the operator.
    Operator,
}

impl Purpose {
    /// Returns the name of the command for people, as in "no answer to ...".
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Request { name, .. } => name,
            Self::Target => "the target",
            Self::Path => "the path",
            Self::Operator => "a command of the operator",
        }
    }

    /// Returns the time for the answer.
    pub(super) fn timeout(self) -> Duration {
        match self {
            Self::Request { timeout, .. } => timeout,
            _ => ANSWER_TIMEOUT,
        }
    }

    /// Returns whether the command is sent again until it is answered.
    fn is_repeated(self) -> bool {
        self != Self::Path
    }
}

/// Command that waits for its answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) id: u16,
    pub(super) command: Command,
    pub(super) purpose: Purpose,
    /// The goal that it belongs to.
    goal: Option<GoalNumber>,
    last_sent: Duration,
    /// When the time for the answer is up.
    deadline: Duration,
}

/// Commands that wait for their answers. Times are those of the link's transport.
#[derive(Debug, Default)]
pub(super) struct CommandTable {
    /// Id of the last command.
    last_id: u16,
    entries: Vec<Entry>,
}

impl CommandTable {
    /// Returns the next id, never 0: the board answers a command that it cannot read with 0.
    pub(super) fn new_id(&mut self) -> u16 {
        self.last_id = self.last_id.checked_add(1).unwrap_or(1);
        self.last_id
    }

    /// Adds a command that is sent at `now`. Returns its id.
    pub(super) fn add(
        &mut self,
        command: Command,
        purpose: Purpose,
        goal: Option<GoalNumber>,
        now: Duration,
    ) -> u16 {
        let id = self.new_id();
        let deadline = now + purpose.timeout();
        self.entries.push(Entry { id, command, purpose, goal, last_sent: now, deadline });
        id
    }

    /// Removes and returns the command `id`, which was answered.
    pub(super) fn take(&mut self, id: u16) -> Option<Entry> {
        let at = self.entries.iter().position(|entry| entry.id == id)?;
        Some(self.entries.remove(at))
    }

    /// Returns the command `id`.
    pub(super) fn get(&self, id: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.id == id)
    }

    /// Returns the time from `now` until a command is sent again or given up.
    pub(super) fn time_left(&self, now: Duration) -> Duration {
        let next = self.entries.iter().map(|entry| match entry.purpose.is_repeated() {
            true => entry.deadline.min(entry.last_sent + REPEAT_AFTER),
            false => entry.deadline,
        });
        next.min().unwrap_or(Duration::MAX).saturating_sub(now)
    }

    /// Removes and returns a command whose answer has not come in time.
    pub(super) fn take_expired(&mut self, now: Duration) -> Option<Entry> {
        let at = self.entries.iter().position(|entry| now >= entry.deadline)?;
        Some(self.entries.remove(at))
    }

    /// Returns a command that has to be sent again at `now`, and notes that it is.
    pub(super) fn take_due(&mut self, now: Duration) -> Option<Entry> {
        let is_due = |entry: &&mut Entry| {
            entry.purpose.is_repeated() && now >= entry.last_sent + REPEAT_AFTER
        };
        let entry = self.entries.iter_mut().find(is_due)?;
        entry.last_sent = now;
        Some(*entry)
    }

    /// Returns whether a command with this purpose waits for its answer.
    pub(super) fn has(&self, purpose: Purpose) -> bool {
        self.entries.iter().any(|entry| entry.purpose == purpose)
    }

    /// Gives up the commands with this purpose.
    pub(super) fn give_up(&mut self, purpose: Purpose) {
        self.entries.retain(|entry| entry.purpose != purpose);
    }

    /// Gives up the commands of a goal that has ended.
    pub(super) fn end_goal(&mut self, goal: GoalNumber) {
        self.entries.retain(|entry| entry.goal != Some(goal));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Time in milliseconds, and id of a command.
    type Fate = (u64, u16);

    /// Returns the commands that are sent again until `end`, milliseconds, and those that are given
    /// up. The table is looked at every millisecond.
    fn fate(table: &mut CommandTable, end: u64) -> (Vec<Fate>, Vec<Fate>) {
        let (mut repeated, mut given_up) = (Vec::new(), Vec::new());
        for now in 0..=end {
            while let Some(entry) = table.take_expired(ms(now)) {
                given_up.push((now, entry.id));
            }
            while let Some(entry) = table.take_due(ms(now)) {
                repeated.push((now, entry.id));
            }
        }
        (repeated, given_up)
    }

    #[test]
    fn a_command_is_repeated_with_its_id_and_given_up_once() {
        let mut table = CommandTable::default();
        let id = table.add(Command::Hold, Purpose::Operator, None, ms(0));
        assert_eq!(table.time_left(ms(30)), ms(70));
        let (repeated, given_up) = fate(&mut table, 5000);
        let every_100 = (1..15).map(|k| (100 * k, id));
        assert!(repeated.iter().copied().eq(every_100), "{repeated:?}");
        assert_eq!(given_up, [(1500, id)]);
    }

    #[test]
    fn an_answer_ends_a_command_and_a_second_one_finds_none() {
        let mut table = CommandTable::default();
        let id = table.add(Command::Hold, Purpose::Operator, None, ms(0));
        assert_eq!(table.take(id).map(|entry| entry.command), Some(Command::Hold));
        assert!(table.take(id).is_none());
        assert_eq!(fate(&mut table, 5000), (Vec::new(), Vec::new()));
        assert_eq!(table.time_left(ms(0)), Duration::MAX);
    }

    #[test]
    fn a_part_of_a_path_is_not_repeated() {
        let mut table = CommandTable::default();
        let goal = Some(GoalNumber::default());
        let id = table.add(Command::Hold, Purpose::Path, goal, ms(0));
        assert_eq!(fate(&mut table, 5000), (Vec::new(), vec![(1500, id)]));
    }

    #[test]
    fn a_command_of_a_goal_that_has_ended_is_never_sent_again() {
        let mut table = CommandTable::default();
        let (first, second) = (GoalNumber::default(), GoalNumber::default().next());
        table.add(Command::Hold, Purpose::Target, Some(first), ms(0));
        let kept = table.add(Command::Hold, Purpose::Target, Some(second), ms(0));
        let of_no_goal = table.add(Command::Stop, Purpose::Operator, None, ms(0));
        table.end_goal(first);
        let (repeated, given_up) = fate(&mut table, 1499);
        assert!(repeated.iter().all(|(_, id)| [kept, of_no_goal].contains(id)), "{repeated:?}");
        assert_eq!((repeated.len(), given_up.len()), (28, 0));
    }

    #[test]
    fn ids_differ_and_none_is_0() {
        let mut table = CommandTable::default();
        let ids: Vec<u16> = (0..=u16::MAX).map(|_| table.new_id()).collect();
        assert!(!ids.contains(&0));
        assert_eq!((ids[0], ids[65_534], ids[65_535]), (1, u16::MAX, 1));
    }
}
