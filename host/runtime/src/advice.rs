//! What to do after a fault, in words for people. docs/use/faults.md explains each fault and begins
//! with the same words; a test compares them. Where this program has counted the cause,
//! [`BoardFault::advice`](crate::board_fault::BoardFault::advice) has better ones.

use plumb_protocol::message::Fault;

/// Returns what to do next after the board has stopped by itself.
pub fn after_fault(fault: Fault) -> &'static str {
    match fault {
        Fault::HostSilent => {
            "Check whether the computer is overloaded or asleep, or the cable to the board loose. \
             Then clear the fault."
        }
        Fault::PositionLost => {
            "Check that the camera delivers pictures, and that the ball is in view and lit. Then \
             clear the fault and set the target again."
        }
        Fault::BallOutside => {
            "Check whether the ball really left the workspace. If not, the camera's pose is wrong."
        }
        Fault::TargetOutside => "Clear the fault and choose a target inside the workspace.",
        Fault::Travel(_) => {
            "Clear the fault. Choose a target that the wound cables can reach, or check the cables \
             before you give the motors more travel."
        }
        Fault::ErrorGrowing => {
            "Check the wiring: a motor is swapped or reversed, or a cable is torn, or the ball is \
             caught, or the camera's pose is wrong, or it sees another ball, or the link is slow. \
             Then clear the fault."
        }
        Fault::EmergencyStop => {
            "The motors have no current and the ball falls. Close the emergency loop, hang the \
             ball again, then clear the fault."
        }
        Fault::Watchdog => {
            "The motor positions begin at 0 where the motors stand. Check the cables, then clear \
             the fault, and report the cause of the restart."
        }
        Fault::LawLate => "This is a fault of the firmware: report it with the run's folder.",
        Fault::NotFollowing => {
            "Check for a slack or torn cable, a motor that has stalled, a ball that is caught, a \
             picture that stands still, or a target outside the triangle of the motors. Clear the \
             fault and jog the motor back until its cable is taut."
        }
        Fault::NoProgress => {
            "Clear the fault. Choose a target within reach of taut cables, and check that every \
             motor turns the right way."
        }
        Fault::Driver => {
            "Check the supply of the Motor HATs and their wires: 3.3 V, ground, GP16 and GP17. \
             Then clear the fault, and run `plumb home` with the ball at a known place."
        }
    }
}
