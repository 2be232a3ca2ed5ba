//! Which command is accepted in which state.

use plumb_protocol::message::{Command, Fault, Refusal};

use super::state::{AfterStop, State};

/// Checks whether `state` accepts `command`. A command that is accepted here may still be refused
/// for its content: a target outside the workspace, a jog beyond the travel.
///
/// # Errors
/// Returns the refusal that the host gets.
pub(super) fn admit(state: &State, command: &Command) -> Result<(), Refusal> {
    match command {
        Command::Hello(_)
        | Command::Stop
        | Command::Bootloader
        | Command::Status
        | Command::Diagnose
        | Command::Wire(_) => Ok(()),
        // Of a later version: refused when it is executed, in every state.
        Command::Rates(_) | Command::Pen(_) => Ok(()),
        Command::Position(_) => admit_position(state),
        Command::Configure(_) => match state {
            State::Unconfigured | State::Ready => Ok(()),
            _ => Err(refusal(state)),
        },
        Command::Target(_) | Command::Hold | Command::Follow(_) => match state {
            State::Ready
            | State::Seeking(_)
            | State::Holding(_)
            | State::Following(_)
            | State::Settling(_)
            | State::Stopping { then: AfterStop::Ready } => Ok(()),
            _ => Err(refusal(state)),
        },
        Command::Jog(_) | Command::Home | Command::TestFlash | Command::Prior(_) => match state {
            State::Ready => Ok(()),
            _ => Err(refusal(state)),
        },
        Command::Measure => match state {
            State::Unconfigured | State::Ready => Ok(()),
            _ => Err(refusal(state)),
        },
        Command::Store => match state {
            State::Ready | State::Fault { storing: None, then: AfterStop::Ready, .. } => Ok(()),
            State::Fault { .. } => Err(Refusal::Busy(state.on_wire())),
            _ => Err(refusal(state)),
        },
        Command::ClearFault => match state {
            State::Fault { storing: Some(_), .. }
            | State::Fault { then: AfterStop::Bootloader, .. } => {
                Err(Refusal::Busy(state.on_wire()))
            }
            State::Fault { fault: Fault::Clock, .. } => Err(refusal(state)),
            _ => Ok(()),
        },
    }
}

/// Checks whether `state` accepts a position. [`admit`] calls it for a whole [`Command`].
pub(super) fn admit_position(state: &State) -> Result<(), Refusal> {
    match state {
        State::Unconfigured => Err(Refusal::Unconfigured),
        _ => Ok(()),
    }
}

/// Returns the refusal of a command that needs another state.
fn refusal(state: &State) -> Refusal {
    match state {
        State::Unconfigured => Refusal::Unconfigured,
        State::Fault { fault, .. } => Refusal::Faulted(*fault),
        _ => Refusal::Busy(state.on_wire()),
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::message::{self, Hello, Jog, KNOTS, Knot, Position, Reference};
    use plumb_protocol::units::{Micrometres, Micros, Point, Rate, Steps16};
    use plumb_protocol::{Config, Wiring};

    use super::super::session::RequestKey;
    use super::super::state::{FlashJob, FlashTask, Goal, Settling};
    use super::*;
    use crate::plan::Jogging;

    const FAULT: Fault = Fault::PositionLost;
    const JOB: FlashJob =
        FlashJob { request: RequestKey { id: 1, crc: 0 }, task: FlashTask::Store };
    const GOAL: Goal = Goal { target: Point([Micrometres(0); 3]), command: Some(1) };

    /// Every state, in the order of the columns of [`EXPECTED`].
    fn states() -> [State; 14] {
        use AfterStop::{Bootloader, Ready};
        let fault = |storing, then| State::Fault { fault: FAULT, storing, then };
        [
            State::Unconfigured,
            State::Ready,
            State::Jogging(Jogging::new(0, 16, 256)),
            State::Seeking(GOAL),
            State::Holding(GOAL),
            State::Following(GOAL),
            State::Settling(Settling::new(1)),
            State::Stopping { then: Ready },
            State::Stopping { then: Bootloader },
            State::Storing { job: JOB, then: Ready },
            State::Storing { job: JOB, then: Bootloader },
            fault(None, Ready),
            fault(Some(JOB), Ready),
            fault(None, Bootloader),
        ]
    }

    /// Every command, in the order of the rows of [`EXPECTED`].
    fn commands() -> [Command; 17] {
        let position = Position { sequence: 1, age_us: 0, ball: None, covariance: None };
        [
            Command::Hello(Hello::OURS),
            Command::Stop,
            Command::Bootloader,
            Command::Status,
            Command::Position(position),
            Command::Configure(Config::example()),
            Command::Target(GOAL.target),
            Command::Hold,
            Command::Jog(Jog { motor: 0, distance: Steps16(16), rate: Rate(256) }),
            Command::Store,
            Command::ClearFault,
            Command::Home,
            Command::Follow(Reference {
                sequence: 1,
                now: Micros(0),
                waits: true,
                first: Micros(0),
                interval_us: 100_000,
                knots: [Knot::default(); KNOTS],
            }),
            Command::Diagnose,
            Command::Measure,
            Command::TestFlash,
            Command::Wire(Wiring::example()),
        ]
    }

    /// `+` accepted, `u` Unconfigured, `b` Busy with the state, `f` Faulted with the fault.
    #[rustfmt::skip]
    const EXPECTED: [[char; 14]; 17] = [
        // Unconfigured, Ready, Jogging, Seeking, Holding, Following, Settling,
        // Stopping (then Bootloader), Storing (then Bootloader), Fault (storing, then Bootloader)
        /* Hello      */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Stop       */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Bootloader */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Status     */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Position   */ ['u', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Configure  */ ['+', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Target     */ ['u', '+', 'b', '+', '+', '+', '+', '+', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Hold       */ ['u', '+', 'b', '+', '+', '+', '+', '+', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Jog        */ ['u', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Store      */ ['u', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', '+', 'b', 'b'],
        /* ClearFault */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', 'b', 'b'],
        /* Home       */ ['u', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Follow     */ ['u', '+', 'b', '+', '+', '+', '+', '+', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Diagnose   */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
        /* Measure    */ ['+', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* TestFlash  */ ['u', '+', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'b', 'f', 'f', 'f'],
        /* Wire       */ ['+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+', '+'],
    ];

    /// State on the wire of each column.
    const ON_WIRE: [message::State; 14] = {
        use message::State::*;
        let fault = Fault(FAULT);
        [
            Unconfigured,
            Ready,
            Jogging,
            Seeking,
            Holding,
            Following,
            Stopping,
            Stopping,
            Stopping,
            Storing,
            Storing,
            fault,
            fault,
            fault,
        ]
    };

    #[test]
    fn every_command_is_admitted_or_refused_in_every_state_as_in_the_table() {
        for (command, row) in commands().iter().zip(EXPECTED) {
            for ((state, expected), on_wire) in states().iter().zip(row).zip(ON_WIRE) {
                let expected = match expected {
                    '+' => Ok(()),
                    'u' => Err(Refusal::Unconfigured),
                    'f' => Err(Refusal::Faulted(FAULT)),
                    _ => Err(Refusal::Busy(on_wire)),
                };
                assert_eq!(admit(state, command), expected, "{command:?} in {state:?}");
                assert_eq!(state.on_wire(), on_wire);
            }
        }
    }
}
