//! The fault of a board, the cause that this program has counted, and what to do next.

use std::fmt;
use std::time::Duration;

use plumb_protocol::message::{DriverFault, Fault};
use plumb_protocol::units::Micrometres;

use crate::wakeups;

/// Fault for which the board stopped by itself. Its text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardFault {
    /// Fault that the board reports.
    pub fault: Fault,
    /// Its cause, where this program has counted one.
    pub cause: Option<FaultCause>,
}

impl BoardFault {
    /// Returns whether the cause is that this program woke late.
    pub fn is_of_the_computer(&self) -> bool {
        matches!(self.cause, Some(FaultCause::LateHost { .. }))
    }

    /// Returns whether the motor positions are not to be trusted: the motors may have turned
    /// without a count, or the board has begun to count anew.
    pub fn asks_for_home(&self) -> bool {
        match self.fault {
            Fault::EmergencyStop | Fault::Watchdog => true,
            Fault::Driver(fault) => matches!(
                fault,
                DriverFault::Hat
                    | DriverFault::Silent(_)
                    | DriverFault::Reset(_)
                    | DriverFault::Undervoltage(_)
                    | DriverFault::Overtemperature(_)
                    | DriverFault::Short(_)
            ),
            _ => false,
        }
    }

    /// Returns what to do next, in words for people.
    pub fn advice(&self) -> &'static str {
        self.cause.map_or_else(|| after_fault(self.fault), |cause| cause.advice())
    }
}

impl From<Fault> for BoardFault {
    fn from(fault: Fault) -> Self {
        Self { fault, cause: None }
    }
}

impl fmt::Display for BoardFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.fault)?;
        self.cause.map_or(Ok(()), |cause| write!(f, " ({cause})"))
    }
}

/// Cause of a fault. Those of [`Fault::HostSilent`] and [`Fault::PositionLost`] are counted over
/// one and a half times the deadline that has passed; [`Fault::BallOutside`] has the place of the
/// ball. Its text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultCause {
    /// Frames were damaged on their way to the board.
    DamagedFrames {
        /// Damaged frames, by the board's last count before its stop.
        damaged: u32,
        /// Frames that were sent.
        sent: u32,
    },
    /// This program woke late: it sent nothing in the meantime.
    LateHost {
        /// Number of late wake-ups.
        times: u32,
        /// Longest time without a message to the board.
        longest: Duration,
    },
    /// Positions were too old when they came to the board.
    OldPositions {
        /// Positions that the board refused for their age.
        old: u32,
        /// Greatest age with which a position was sent.
        oldest: Duration,
    },
    /// The last position that was sent is outside the workspace.
    Outside {
        /// Axis on which the ball is farthest outside: x, y or z.
        axis: char,
        /// Coordinate of the ball.
        at: Micrometres,
        /// Border of the workspace that it has passed.
        border: Micrometres,
    },
}

impl FaultCause {
    /// Returns what to do next, in words for people.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::DamagedFrames { .. } => {
                "Check the baud rate, the cable and the ground between computer and board, and \
                 keep the motors' wires away from them. Then clear the fault."
            }
            Self::LateHost { .. } => {
                "Check what else uses the computer's processor or disk, and whether it sleeps. \
                 Then clear the fault."
            }
            Self::Outside { .. } => {
                "Look where the ball is. If it really is outside: clear the fault, jog it back, \
                 and check whether a motor is swapped or reversed; or choose targets farther \
                 inside the workspace, or correct the workspace. If it is inside, the camera's \
                 pose is wrong. `plumb check` names swapped and reversed motors."
            }
            Self::OldPositions { .. } => {
                "Check what else uses the computer's processor, or choose smaller or fewer \
                 pictures; the camera's latency may be wrong, too. Then clear the fault."
            }
        }
    }
}

impl fmt::Display for FaultCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DamagedFrames { damaged, sent } => {
                write!(
                    f,
                    "at least {damaged} of {sent} frames to the board were damaged on the wire"
                )
            }
            Self::LateHost { times, longest } => {
                let (longest, times) = (longest.as_secs_f64(), wakeups::times((*times).into()));
                write!(
                    f,
                    "this computer is overloaded or was asleep: the program woke late {times}, and \
                     was silent for {longest:.1} s"
                )
            }
            Self::OldPositions { old, oldest } => {
                let oldest = oldest.as_secs_f64();
                write!(f, "{old} positions were too old: up to {oldest:.1} s")
            }
            Self::Outside { axis, at, border } => {
                let side = if at < border { "below" } else { "above" };
                let [at, border] = [at, border].map(|it| it.to_si());
                write!(f, "{axis} = {at:.3} m is {side} the {border:.3} m of the workspace")
            }
        }
    }
}

/// Returns what to do next after the board has stopped by itself. docs/use/faults.md explains each
/// fault and begins with the same words; a test compares them. Where the cause was counted,
/// [`BoardFault::advice`] returns more exact words.
pub fn after_fault(fault: Fault) -> &'static str {
    match fault {
        Fault::HostSilent => {
            "Check whether the program was killed, the computer is overloaded or asleep, or the \
             cable to the board is loose. Then clear the fault."
        }
        Fault::PositionLost => {
            "Check that the camera delivers pictures, several in the time of \
             `deadlines.position`, and that it sees the ball. Then clear the fault and begin again."
        }
        Fault::BallOutside => {
            "Check whether the ball really left the workspace: then clear the fault, jog the ball \
             back, and check whether a motor is swapped or reversed. If not, the camera's pose is \
             wrong. `plumb check` names swapped and reversed motors."
        }
        Fault::TargetOutside => "Clear the fault and choose a target inside the workspace.",
        Fault::Travel(_) => {
            "Clear the fault. Choose a target that the wound cables can reach. If the cables were \
             wound anew: `plumb home` with the ball in the workspace. Before you give the motors \
             more travel, check the cables, and run `plumb check --file-only`."
        }
        Fault::ErrorGrowing => {
            "Check the wiring: a motor is swapped or reversed, or a cable is torn, or the ball is \
             caught, or the camera's pose is wrong, or it sees another ball, or the link is slow. \
             Then clear the fault. `plumb check` names the cause."
        }
        Fault::EmergencyStop => {
            "The motors have no current and the ball falls. End the run if it still goes on. Close \
             the emergency loop, then clear the fault with your hands off the drums. Hang the ball \
             again, and run `plumb home` with it at a known place."
        }
        Fault::Watchdog => {
            "The motor positions begin at 0 where the motors stand. Check the cables, then clear \
             the fault, and report the cause of the restart. Hang the ball, and run `plumb home` \
             with it at a known place."
        }
        Fault::LawLate | Fault::LateTicks => {
            "This is a fault of the firmware: report it with the run's folder."
        }
        Fault::Clock => {
            "The board refuses to drive. Flash the firmware of this release: `plumb board flash`. \
             If the fault stays, report it."
        }
        Fault::NotFollowing => {
            "Check for a slack or torn cable, a motor that has stalled, a ball that is caught, a \
             picture that stands still, or a target outside the triangle of the motors. Clear the \
             fault and jog the motor back until its cable is taut. Then `plumb check` looks at all \
             three."
        }
        Fault::NoProgress => {
            "Clear the fault. Choose a target within reach of taut cables, and check that every \
             motor turns the right way."
        }
        Fault::Driver(fault) => after_driver_fault(fault),
    }
}

/// Returns what to do next after a motor driver failed.
fn after_driver_fault(fault: DriverFault) -> &'static str {
    match fault {
        DriverFault::Hat => {
            "Check the supply of the Motor HATs and their wires: 3.3 V, ground, GP16 and GP17. \
             Then clear the fault, and run `plumb home` with the ball at a known place."
        }
        DriverFault::Silent(_) => {
            "Check that the motors' supply is on, the UART's wires, and the driver's address. If \
             the supply was off: hit the emergency button, switch the supply on, and release the \
             button. Then clear the fault, and run `plumb home` with the ball at a known place."
        }
        DriverFault::BadReplies(_) => {
            "Check the UART's wires and their ground, and keep the motors' wires away from them. \
             Then clear the fault."
        }
        DriverFault::Version(_) => "Check which chip is on the driver: only a TMC2209 will do.",
        DriverFault::Address(_) => {
            "Check the addresses of the drivers (MS1, MS2), the wires of DIR, and \
             `motors.driver.tmc2209-uart.addresses`. Then clear the fault."
        }
        DriverFault::Reset(_) | DriverFault::Undervoltage(_) => {
            "Check the motors' supply: its voltage has broken down. Then clear the fault, and run \
             `plumb home` with the ball at a known place."
        }
        DriverFault::Overtemperature(_) => {
            "Let the driver cool down. Then give it a fan or a heat sink, or the motor less \
             current; clear the fault, and run `plumb home` with the ball at a known place."
        }
        DriverFault::Short(_) => {
            "Switch the motors' supply off, and look for a short circuit in the motor and its \
             wires. Hit the emergency button, switch the supply on again, and release the button. \
             Then clear the fault, hang the ball again, and run `plumb home` with it at a known \
             place."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The steps stand in their order: docs/use/uart-drivers.md, "The motors' supply".
    #[test]
    fn the_supply_is_switched_on_while_the_emergency_button_holds_the_drivers_off() {
        for fault in [DriverFault::Short(1), DriverFault::Silent(1)] {
            let mut rest = after_driver_fault(fault).to_lowercase();
            for step in ["hit the emergency button", "supply on", "release", "clear", "home"] {
                let (_, behind) = rest.split_once(step).unwrap_or_else(|| panic!("{step}: {rest}"));
                rest = behind.to_owned();
            }
        }
    }

    #[test]
    fn only_faults_that_lose_the_motor_positions_ask_for_home() {
        for (fault, is_lost) in [
            (Fault::EmergencyStop, true),
            (Fault::Watchdog, true),
            (Fault::Driver(DriverFault::Hat), true),
            (Fault::Driver(DriverFault::BadReplies(1)), false),
            (Fault::Driver(DriverFault::Reset(1)), true),
            (Fault::Travel(0), false),
            (Fault::ErrorGrowing, false),
        ] {
            assert_eq!(BoardFault::from(fault).asks_for_home(), is_lost, "{fault}");
            // The advice of Travel names it for cables that were wound anew.
            let names_it = after_fault(fault).contains("`plumb home`");
            assert_eq!(names_it, is_lost || fault == Fault::Travel(0), "{fault}");
        }
    }
}
