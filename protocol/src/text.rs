//! Texts of refusals, faults, states and start causes (`Display`).

use core::fmt;

use crate::message::{ConfigField, DriverFault, Fault, Refusal, StartCause, State};
use crate::wiring::{Line, PinError, WiringError};

/// Returns the letter of motor 0, 1 or 2.
fn motor(index: u8) -> char {
    (b'A'.saturating_add(index)) as char
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HostSilent => f.write_str("nothing came from the host for too long"),
            Self::PositionLost => f.write_str("no fresh position of the ball came for too long"),
            Self::BallOutside => f.write_str("the ball left the workspace"),
            Self::TargetOutside => f.write_str("a target outside the workspace was asked for"),
            Self::Travel(i) => write!(f, "motor {} would have passed its travel limit", motor(*i)),
            Self::ErrorGrowing => {
                f.write_str("the error keeps growing: is a motor swapped or reversed?")
            }
            Self::EmergencyStop => f.write_str("the emergency input opened"),
            Self::Watchdog => {
                f.write_str("the board restarted by itself; its motor positions begin anew")
            }
            Self::LawLate => {
                f.write_str("the control law had no answer in time (a fault of the firmware)")
            }
            Self::NotFollowing => f.write_str(
                "the motors turn and the ball does not follow: is a cable slack or torn, a motor \
                 stalled, or the ball caught?",
            ),
            Self::NoProgress => {
                f.write_str("the ball gets no nearer to its target: is the target within reach?")
            }
            Self::Driver(fault) => fault.fmt(f),
            Self::LateTicks => f.write_str("the pulses came late (a fault of the firmware)"),
            Self::Clock => f.write_str("the chip's clock is wrong (a fault of the firmware)"),
        }
    }
}

impl fmt::Display for DriverFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (index, what) = match *self {
            Self::Hat => return f.write_str("a Motor HAT does not answer"),
            Self::Silent(index) => (index, "does not answer"),
            Self::BadReplies(index) => (index, "answers with damaged bytes"),
            Self::Version(index) => (index, "is no TMC2209"),
            Self::Address(index) => (index, "has the address of another one"),
            Self::Reset(index) => (index, "was reset"),
            Self::Undervoltage(index) => (index, "has too low a supply voltage"),
            Self::Overtemperature(index) => (index, "is too hot and has switched off"),
            Self::Short(index) => (index, "has a short circuit and has switched off"),
        };
        write!(f, "the driver of motor {} {what}", motor(index))
    }
}

impl fmt::Display for StartCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PowerOn => "power on",
            Self::ResetPin => "its reset pin",
            Self::Watchdog => "the watchdog",
            Self::Panic(place) => return write!(f, "an error in its program (place {place:08x})"),
            Self::HardFault => "a fault of its processor",
            Self::Requested => "a requested restart",
            Self::BrownOut => "a brown-out of its supply",
        })
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unconfigured => f.write_str("unconfigured"),
            Self::Ready => f.write_str("ready"),
            Self::Seeking => f.write_str("seeking"),
            Self::Holding => f.write_str("holding"),
            Self::Fault(fault) => write!(f, "fault: {fault}"),
            Self::Jogging => f.write_str("jogging"),
            Self::Stopping => f.write_str("stopping"),
            Self::Storing => f.write_str("storing"),
            Self::Following => f.write_str("following"),
        }
    }
}

impl fmt::Display for ConfigField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Signs => {
                "the sign pattern (entries -1, 0, +1, and every motor must move something)"
            }
            Self::Bounds => "the bounds (0 < alpha <= beta <= 8)",
            Self::Gain => "the gain (above 0, at most 16 steps/s for a micrometre)",
            Self::MaxRate => {
                "a motor's highest rate (above 0, within what the board was built for)"
            }
            Self::MaxAcceleration => "a motor's acceleration (40 to 4 000 000 steps/s²)",
            Self::Travel => "a motor's travel (it must contain 0)",
            Self::Microsteps => "the microsteps (1, 2, 4, 8 or 16)",
            Self::Workspace => "the workspace (min below max, within 4 m of the origin)",
            Self::Reached => {
                "what counts as reached (radius above 0 and at most 1 m, 1 frame or more)"
            }
            Self::Deadlines => "the deadlines (above 0, at most 5 s)",
            Self::Growth => "the error's growth limit (margin up to 1 m, time up to 5 s)",
            Self::Drivers => {
                "the motor drivers (pulse times up to 4.1 µs, 200 ms after ENABLE, a duty of 1 to \
                 100 %, currents that the sense resistor allows)"
            }
            Self::Mean => "the running mean (at most 400 ms)",
            Self::Delay => "the law's delay (at most 500 ms)",
            Self::Law => "the law: taut needs three motors",
            Self::Motors => "the motors (two or three, as many as are wired)",
            Self::Prior => "the prior (in range, for the law and the motors of the configuration)",
            Self::MaxAge => {
                "the highest age of a position (it must be below the deadline for positions, or \
                 the board would drive on positions older than that deadline)"
            }
            Self::Jog => "the limits of jogs (rate and distance above 0)",
            Self::Following => {
                "the turn without the ball (up to 100 000 steps, movement 5 mm to 1 m)"
            }
            Self::Progress => "the time without progress (up to 60 s, margin up to 1 m)",
            Self::Path => {
                "the limits of a path (speed up to 2 m/s, acceleration up to 20 m/s², jerk up to \
                 1000 m/s³, deviation up to 1 m)"
            }
        })
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotGreeted => f.write_str("no matching Hello came before"),
            Self::Malformed => {
                f.write_str("the board does not know this command, or a value in it")
            }
            Self::Unconfigured => f.write_str("the board is not configured"),
            Self::Busy(State::Fault(fault)) => {
                write!(f, "not before the board has come to rest after its fault ({fault})")
            }
            Self::Busy(state) => write!(f, "not while the board is {state}"),
            Self::Faulted(fault @ Fault::EmergencyStop) => write!(
                f,
                "the board has stopped by itself ({fault}); close the emergency loop, then clear \
                 the fault"
            ),
            Self::Faulted(fault) => {
                write!(f, "the board has stopped by itself ({fault}); clear the fault first")
            }
            Self::Config(field) => write!(f, "the configuration is out of range: {field}"),
            Self::TargetOutside => f.write_str("the target is outside the workspace"),
            Self::PositionStale => f.write_str("the position is too old"),
            Self::PositionOutOfOrder => f.write_str("a newer position came before"),
            Self::BallOutside => f.write_str("the ball is outside the workspace"),
            Self::NoPosition => f.write_str("no position of the ball is known"),
            Self::NoSuchMotor => f.write_str("the rig has no such motor"),
            Self::JogRate => f.write_str(
                "a jog needs a rate above 0, within the limits of its motor and of jogs",
            ),
            Self::JogTravel => f.write_str("the jog would pass the motor's travel limit"),
            Self::Unsupported => {
                f.write_str("this board cannot do that; an emulated one has no flash and no pins")
            }
            Self::NotStored => f.write_str("the board's flash could not be written"),
            Self::OutsideTravel(i) => write!(
                f,
                "motor {} stands outside its travel; jog it back inside, or configure a wider \
                 travel",
                motor(*i)
            ),
            Self::JogDistance => {
                f.write_str("the jog is longer than the limit of jogs; divide it into shorter ones")
            }
            Self::ReferenceOutOfOrder => f.write_str("a newer reference came before"),
            Self::ReferenceRange => f.write_str(
                "the knots of a reference are 10 to 500 ms apart, and move at 2 m/s at most",
            ),
            Self::ReferenceOutside => f.write_str("the path leaves the workspace"),
            Self::CoilsConfigured => {
                f.write_str("coils are configured: it is for drivers with STEP and DIR inputs")
            }
            Self::Wiring(error) => write!(f, "the board cannot be wired so: {error}"),
            Self::NotWired => f.write_str("no wiring came before the configuration"),
        }
    }
}

impl fmt::Display for WiringError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board => f.write_str("the rig file names a board with another chip"),
            Self::Drivers => {
                f.write_str("this board has drivers of its own, and no coils or Motor HATs")
            }
            Self::Pin(line, error) => write!(f, "{line} is at {error}"),
            Self::Addresses => {
                f.write_str("the addresses of the drivers are 0 to 3, each at most once")
            }
            Self::Pulse => f.write_str(
                "STEP must be high for longer than its chip can make a pulse (4.1 µs on an \
                 RP2040, 3.4 µs on an RP2350)",
            ),
            Self::Motors => f.write_str("this board steps two or three motors, each with its pins"),
            Self::Pen => f.write_str("this board has no pen"),
            Self::InvertedEmergency => f.write_str(
                "its chip cannot see that the wire of an inverted emergency input is cut; put the \
                 contact between the input and ground",
            ),
        }
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Step(i) => write!(f, "STEP of motor {}", motor(*i)),
            Self::Direction(i) => write!(f, "DIR of motor {}", motor(*i)),
            Self::Enable(i) => write!(f, "ENABLE {}", motor(*i)),
            Self::Emergency => f.write_str("the emergency input"),
            Self::Led => f.write_str("the LED"),
            Self::UartTx => f.write_str("TX of the drivers' UART"),
            Self::UartRx => f.write_str("RX of the drivers' UART"),
        }
    }
}

impl fmt::Display for PinError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Missing => "a pin that the board does not have",
            Self::Taken => "a pin that the board uses itself",
            Self::Twice => "a pin that is in use already",
            Self::NoUart => "a pin without that UART",
        })
    }
}
