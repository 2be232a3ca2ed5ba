//! Messages in both directions.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::diagnostics::{Diagnostics, Measurement};
use crate::dimension::{MotorList, PerAxis};
use crate::frame::{self, FrameError};
use crate::prior::Prior;
use crate::provenance::Provenance;
use crate::schema;
use crate::units::{Covariance, Micrometres, Micros, Point, Rate, RelativeTension, Speed, Steps16};
use crate::wiring::{Wiring, WiringError};

pub use crate::diagnostics::StartCause;

/// First bytes of every [`Hello`]: "PLMB".
pub const MAGIC: [u8; 4] = *b"PLMB";

/// Version of the messages' meaning. [`SCHEMA`] covers their bytes.
pub const VERSION: u16 = 3;

/// Identifier of the message types: a hash of their fields and variants. Any change of a message
/// changes it, but for a variant at the end of an enum that grows: a law, a refusal, a fault.
pub const SCHEMA: [u8; 8] = schema::of::<(ToBoard, FromBoard)>();

/// A command with its request number.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ToBoard {
    /// Number of the request, chosen by the host and returned in [`Answer::id`]. Each new request
    /// has a new number other than 0. A repeated request keeps its number: see the
    /// [crate's front page](crate#order-loss-and-duplicates).
    pub id: u16,
    /// The command.
    pub command: Command,
}

impl ToBoard {
    /// Decodes a [`Command::Position`] from its postcard bytes. Returns `None` for other commands
    /// and for invalid bytes. Positions arrive most often, and this path does not need the memory
    /// of the largest command.
    #[inline(always)]
    pub fn position(message: &[u8]) -> Option<PositionCommand> {
        /// Index of [`Command::Position`] among the variants.
        const POSITION: u32 = 4;
        let mut reader = postcard::Deserializer::from_bytes(message);
        let id = u16::deserialize(&mut reader).ok()?;
        if u32::deserialize(&mut reader) != Ok(POSITION) {
            return None;
        }
        // Matched by reference: the compiler copies the `Result` byte by byte.
        match &Position::deserialize(&mut reader) {
            Ok(position) if reader.finalize().is_ok_and(<[u8]>::is_empty) => {
                Some(PositionCommand { id, position: *position })
            }
            _ => None,
        }
    }
}

/// A [`ToBoard`] with the CRC of its frame. By both numbers a board knows a repetition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// The command with its number.
    pub message: ToBoard,
    /// The CRC.
    pub crc: u32,
}

impl Request {
    /// Decodes a request from its postcard bytes.
    ///
    /// # Errors
    /// [`FrameError::UnknownCommand`] where the bytes after the id are not a command that is known,
    /// [`FrameError::Malformed`] where there is no id.
    #[inline]
    pub fn read(message: &[u8]) -> Result<Self, FrameError> {
        let crc = frame::checksum(message);
        frame::read(message).map(|message| Self { message, crc }).map_err(|malformed| {
            let id = postcard::take_from_bytes::<u16>(message);
            id.map_or(malformed, |(id, _)| FrameError::UnknownCommand { id })
        })
    }
}

/// A [`ToBoard`] that carries a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PositionCommand {
    /// See [`ToBoard::id`].
    pub id: u16,
    /// The position; see [`Command::Position`].
    pub position: Position,
}

/// Command of a host. Grows at its end; the first three never change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Identifies the host and requests the board's [`BoardHello`]. The board moves only after a
    /// matching Hello.
    Hello(Hello),
    /// Ramps down and forgets the target. Accepted in every state.
    Stop,
    /// Ramps down, then restarts into the chip's bootloader.
    Bootloader,
    /// Sets the configuration, with the wiring of the last [`Wire`](Self::Wire) in this session;
    /// refused without one, and while moving.
    Configure(Config),
    /// Reports a measured position of the ball.
    Position(Position),
    /// Sets the target and drives the ball there.
    Target(Point),
    /// Turns one motor, for commissioning.
    Jog(Jog),
    /// Holds the ball at its current position. While motors turn, they ramp down first
    /// ([`State::Stopping`]), and the ball is held where it comes to rest.
    Hold,
    /// Clears the fault, at standstill.
    ClearFault,
    /// Requests telemetry now. Also the heartbeat of a host that sends nothing else.
    Status,
    /// Stores the current configuration in flash; refused while moving. The answer follows when it
    /// is written.
    Store,
    /// Makes the present motor positions the zero of travel. Accepted in [`State::Ready`] only.
    Home,
    /// Has the ball follow a moving reference; carries the part of its path that comes next.
    Follow(Reference),
    /// Requests the board's [`Diagnostics`]. Accepted in every state.
    Diagnose,
    /// Requests a [`Measurement`], and begins to count pulses with the first one. Accepted where
    /// the motors stand and no coils are configured.
    Measure,
    /// Erases, writes and reads a sector of the flash that holds nothing. Refused while moving. The
    /// answer follows when that is done.
    TestFlash,
    /// Sets the wiring of every [`Configure`](Self::Configure) that follows in this session. Alone
    /// it changes no pin. Accepted in every state.
    Wire(Wiring),
    /// What is known of the rig: the law of every [`Configure`](Self::Configure) that follows in
    /// this session begins with it. Boards of this version refuse it.
    Prior(Prior),
    /// Turns the motors at rates of another program. Boards of this version refuse it.
    Rates(Rates),
    /// Lowers or lifts the pen. Boards of this version refuse it.
    Pen(PenPosition),
}

/// Motor rates of a program that takes the law's place. They expire on the board.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rates {
    /// Number of the message; counts up and wraps.
    pub sequence: u16,
    /// Rate of each motor, + pays out.
    pub rates: MotorList<Rate>,
    /// Time from the arrival after which the board ramps down, where nothing newer has come,
    /// microseconds.
    pub valid_us: u32,
}

/// Position of a [pen](crate::wiring::Pen).
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum PenPosition {
    /// Lifted.
    Up,
    /// On the paper.
    Down,
}

/// Protocol identification of one side. Its bytes never change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hello {
    /// [`MAGIC`].
    pub magic: [u8; 4],
    /// [`VERSION`].
    pub version: u16,
    /// [`SCHEMA`].
    pub schema: [u8; 8],
}

impl Hello {
    /// Identification of this build.
    pub const OURS: Self = Self { magic: MAGIC, version: VERSION, schema: SCHEMA };
}

/// Measured position of the ball, from a picture taken `age_us` before this message was sent.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Number of the picture; counts up and wraps.
    pub sequence: u16,
    /// Time from the middle of the exposure to the sending of this message, microseconds.
    pub age_us: u32,
    /// The ball's centre in the rig frame; `None` where the picture shows no ball.
    pub ball: Option<Point>,
    /// Covariance of `ball`; `None` if it is unknown. The board then uses its law's default.
    pub covariance: Option<Covariance>,
}

/// Move of one motor.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jog {
    /// Index of the motor: 0 = A, 1 = B, 2 = C.
    pub motor: u8,
    /// Distance from the current position, + pays out.
    pub distance: Steps16,
    /// Highest rate; above 0.
    pub rate: Rate,
}

/// Number of knots of a [`Reference`].
pub const KNOTS: usize = 6;

/// The part of a path that comes next, as knots at even intervals of the path's time.
///
/// The board interpolates between the knots by cubic Hermite polynomials. Each message replaces the
/// one before it, so that a lost one does no harm. A host sends the next one well before the board
/// reaches the last knot, and begins it with a knot in the past: the board also needs the reference
/// at the capture of the last picture. A path that ends has last knots at rest. Where the last knot
/// moves and nothing newer comes, the board ramps the reference to rest before that knot.
///
/// The path's time is the host's: microseconds from a zero that the host chooses, and keeps as long
/// as the board follows. Knots carry more than a position and a velocity for the present would: the
/// board filters what it tells the motors by a moving average, and needs the reference as much
/// ahead, through corners too.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Number of the message; counts up and wraps.
    pub sequence: u16,
    /// The path's time when the message was sent. The board begins there. A path that does not
    /// [`wait`](Self::waits) goes on with this time.
    pub now: Micros,
    /// Whether the path's time stands still or slows down while the ball is far from the reference
    /// or is not seen, or the motors cannot keep the speed. Otherwise the reference goes on, and
    /// the ball lags.
    pub waits: bool,
    /// The path's time at the first knot.
    pub first: Micros,
    /// Time from a knot to the next, microseconds: 10 000 to 500 000.
    pub interval_us: u32,
    /// The knots.
    pub knots: [Knot; KNOTS],
}

/// A place on a path, and how the reference passes it.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Knot {
    /// Position; inside the workspace.
    pub position: Point,
    /// Velocity along x, y and z: each within ±2 m/s.
    pub velocity: PerAxis<Speed>,
}

/// State of the reference that the board follows.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceState {
    /// Number of the last accepted [`Reference`].
    pub sequence: u16,
    /// The path's time that the reference has reached.
    pub time: Micros,
    /// Speed of the path's time, 1/256: 256 is the speed that the host asked for.
    pub pace: u16,
    /// Position of the reference.
    pub position: Point,
}

/// Message of a board. Grows at its end; [`Hello`](Self::Hello) and
/// [`Provenance`](Self::Provenance) never change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromBoard {
    /// Answers a Hello.
    Hello(BoardHello),
    /// Answers any other command except accepted positions, which telemetry acknowledges by their
    /// sequence number, [`Command::Diagnose`] and accepted [`Command::Measure`].
    Answer(Answer),
    /// Reports the board's state: after every accepted position, and, after a Hello, at least every
    /// 100 ms.
    Telemetry(Telemetry),
    /// Reports that the board has just stopped by itself.
    Fault(FaultReport),
    /// Reports the cause of the board's last start. Follows an accepting Hello.
    Started(StartCause),
    /// Reports the board's program and chip. Follows every answer to a Hello.
    Provenance(Provenance),
    /// Answers a [`Command::Diagnose`].
    Diagnostics(Diagnostics),
    /// Answers a [`Command::Measure`].
    Measurement(Measurement),
    /// Reports what TMC2209 drivers on a UART say of themselves: about ten times a second while
    /// they are watched, and when a warning comes or goes.
    Drivers(DriverReport),
}

/// Identification and limits of the board, and whether the host's Hello matched. Its bytes never
/// change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardHello {
    /// The id of the host's Hello.
    pub id: u16,
    /// Magic, version and schema of the board.
    pub hello: Hello,
    /// Highest pulse rate of a motor in this build, microsteps/s.
    pub max_pulse_rate: u32,
    /// Whether the board accepts this host. It does not move for a host that it does not accept.
    pub accepted: bool,
}

/// Answer to a command.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// The command's [`ToBoard::id`].
    pub id: u16,
    /// Reason for the refusal; `None` if the command was executed.
    pub refusal: Option<Refusal>,
    /// Time of the answer on the board's clock. Telemetry with a later
    /// [`time`](Telemetry::time) describes the board after the command.
    pub time: Micros,
}

/// Reason for refusing a command. A refused command changes nothing except what the variant says.
/// Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// No matching Hello preceded the command.
    NotGreeted,
    /// The board does not know the command, or a value in it.
    Malformed,
    /// The board has no configuration.
    Unconfigured,
    /// The command is not allowed in this state. Send Stop and wait for standstill.
    Busy(State),
    /// The board has stopped by itself. Send ClearFault first.
    Faulted(Fault),
    /// This part of the configuration is out of range.
    Config(ConfigField),
    /// The target is outside the workspace. A board that was moving has stopped with
    /// [`Fault::TargetOutside`].
    TargetOutside,
    /// The picture is older than [`max_age`](crate::config::Deadlines::max_age).
    PositionStale,
    /// The position of a newer picture has already arrived.
    PositionOutOfOrder,
    /// The ball is outside the workspace. The board does not use the position; it stops when this
    /// happens repeatedly.
    BallOutside,
    /// No position of the ball is known, so the board cannot hold it.
    NoPosition,
    /// The configuration has no motor of this index.
    NoSuchMotor,
    /// The jog's rate is not above 0, or is above the motor's limit or
    /// [`max_rate`](crate::config::JogLimits::max_rate).
    JogRate,
    /// The jog would pass the motor's travel limit, or leads further out for a motor that is
    /// outside its travel.
    JogTravel,
    /// This board does not support the command.
    Unsupported,
    /// The flash could not be written. The configuration stored before is unchanged.
    NotStored,
    /// This motor (0 = A, 1 = B, 2 = C) is outside its travel. Jog it back inside first.
    OutsideTravel(u8),
    /// The jog is longer than [`max_distance`](crate::config::JogLimits::max_distance).
    JogDistance,
    /// A newer [`Reference`] has already arrived.
    ReferenceOutOfOrder,
    /// The interval or a velocity of the [`Reference`] is out of range.
    ReferenceRange,
    /// A knot of the [`Reference`] is outside the workspace.
    ReferenceOutside,
    /// Coils are configured: a measurement is for drivers with STEP and DIR inputs.
    CoilsConfigured,
    /// The board cannot be wired so.
    Wiring(WiringError),
    /// A Configure without a [`Wire`](Command::Wire) before it in this session.
    NotWired,
}

/// Part of a configuration that is out of range.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConfigField {
    /// A sign other than -1, 0, +1, or a motor whose signs are all 0; with two motors, a sign in
    /// row x; rows of another length than there are motors.
    Signs,
    /// α = 0, α > β or β above 8.
    Bounds,
    /// Gain of 0 or above 16 steps/s per µm.
    Gain,
    /// Rate of 0 or above the limit of the build.
    MaxRate,
    /// Acceleration below 40 steps/s² or above 4 million.
    MaxAcceleration,
    /// A travel that does not contain 0.
    Travel,
    /// Microsteps other than 1, 2, 4, 8, 16.
    Microsteps,
    /// An empty workspace, or one beyond ±4 m; with two motors, one that is not in the plane
    /// x = 0.
    Workspace,
    /// A radius of 0 or above 1 m, or 0 frames.
    Reached,
    /// A deadline of 0, or one above 5 s.
    Deadlines,
    /// A margin of 0 or above 1 m, a time of 0 or above 5 s.
    Growth,
    /// A driver's pulse time above 4.1 µs, a time after ENABLE above 200 ms, a duty of 0 or above
    /// 100 %, or currents that the sense resistor does not allow.
    Drivers,
    /// A running mean over more than 400 ms.
    Mean,
    /// A delay above 500 ms.
    Delay,
    /// A law that does not know as many motors: [`Taut`](crate::config::Law::Taut) with two.
    Law,
    /// A [`max_age`](crate::config::Deadlines::max_age) at or above the deadline for positions:
    /// positions older than the deadline would be accepted.
    MaxAge,
    /// A rate of 0 or less for jogs, a distance of 0 or less, or one above 67 million steps.
    Jog,
    /// A turn of 0 or above 100 000 steps, a movement below 5 mm or above 1 m.
    Following,
    /// A margin of 0 or above 1 m, a time of 0 or above 60 s.
    Progress,
    /// A speed of 0 or above 2 m/s, an acceleration of 0 or above 20 m/s², a jerk of 0 or above
    /// 1000 m/s³, a deviation of 0 or above 1 m.
    Path,
    /// Fewer than two motors, more than this board steps, or not as many as the wiring has.
    Motors,
    /// A [`Prior`] out of its ranges, or not for the law and the motors of the configuration.
    Prior,
}

/// State of the board. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The board has no configuration.
    Unconfigured,
    /// The board is configured and its motors are at rest.
    Ready,
    /// The board drives the ball to its target.
    Seeking,
    /// The target was reached, and the board keeps the ball there.
    Holding,
    /// The board has stopped by itself: its motors ramp down, then rest until the fault is cleared.
    Fault(Fault),
    /// The board turns one motor by an exact number of steps.
    Jogging,
    /// The motors ramp down, or the board restarts into its bootloader.
    Stopping,
    /// The board writes its flash; the motors are at rest.
    Storing,
    /// The board has the ball follow a moving reference.
    Following,
}

/// Reason why a board stopped by itself. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// No valid frame came from the host before the deadline.
    HostSilent,
    /// No fresh position came before the deadline.
    PositionLost,
    /// Repeated positions were outside the workspace.
    BallOutside,
    /// The host set a target outside the workspace while the board was moving.
    TargetOutside,
    /// A motor (0 = A, 1 = B, 2 = C) would have passed its travel limit.
    Travel(u8),
    /// |e| keeps growing: a motor is swapped or reversed, or the ball is blocked.
    ErrorGrowing,
    /// The emergency input opened.
    EmergencyStop,
    /// The board restarted after a failure ([`StartCause`] names it). The motor positions are
    /// unknown.
    Watchdog,
    /// The control law did not answer in time.
    LawLate,
    /// A motor turned far and the ball did not follow: a cable is slack, slips or is torn, a motor
    /// has stalled, or the ball is caught.
    NotFollowing,
    /// |e| did not get smaller for long: the target is out of reach.
    NoProgress,
    /// A motor driver failed. The motor positions are unknown.
    Driver(DriverFault),
    /// The pulses came late repeatedly: see [`Telemetry::late_ticks`].
    LateTicks,
    /// The chip's clock is not the one that the board plans with. It stays until a restart.
    Clock,
}

/// How a motor driver failed, with the motor (0 = A, 1 = B, 2 = C). Grows at its end. Data sheet of
/// the TMC2209: rev. 1.09, sections 5.1 and 5.5.3.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriverFault {
    /// A Motor HAT did not carry out a command in time.
    Hat,
    /// A TMC2209 did not answer.
    Silent(u8),
    /// The answers of a TMC2209 were damaged, or it did not take what was written.
    BadReplies(u8),
    /// The chip at a driver's address is no TMC2209.
    Version(u8),
    /// A driver's DIR does not follow its motor's pin, or follows another's: two drivers have one
    /// address, or the addresses are exchanged.
    Address(u8),
    /// A TMC2209 was reset, and has lost its settings.
    Reset(u8),
    /// The charge pump's voltage of a TMC2209 is too low.
    Undervoltage(u8),
    /// A TMC2209 has switched its motor off for its temperature.
    Overtemperature(u8),
    /// A TMC2209 has switched its motor off for a short circuit.
    Short(u8),
}

/// State of the board at one moment.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Telemetry {
    /// Time on the board's clock.
    pub time: Micros,
    /// State of the board.
    pub state: State,
    /// [`ToBoard::id`] of the Configure command in force; `None` if none was executed since the
    /// last accepted Hello.
    pub configuration: Option<u16>,
    /// [`ToBoard::id`] of the Target, Hold or Follow command in force; `None` without a target.
    /// State, error and filtered error belong to this target.
    pub target: Option<u16>,
    /// Number of the last accepted position.
    pub sequence: Option<u16>,
    /// Motor positions relative to the zero of travel: where the board started, or the place of
    /// the last [`Command::Home`].
    pub motors: MotorList<Steps16>,
    /// Motor rates.
    pub rates: MotorList<Rate>,
    /// e = position - target of the last accepted position; 0 without a target. The target of a
    /// board that follows is the reference at the position's capture.
    pub error: Point,
    /// |e| of the filtered position; 0 without a target. The reference of a board that follows is
    /// filtered as the position is.
    pub filtered_error: Micrometres,
    /// Number of frames from the host since the start that were torn, corrupted, overlong or not a
    /// command; saturating.
    pub bad_frames: u16,
    /// The law's estimate of the tensions that hold the ball at rest where it is; order A, B, C.
    /// `None` without a target, before the law's first answer, and with a law without an
    /// estimate: only [`Taut`](crate::config::Law::Taut) has one.
    pub tensions: Option<MotorList<RelativeTension>>,
    /// State of the reference while the board follows one.
    pub reference: Option<ReferenceState>,
    /// Number of ticks since the start that came late while motors turned: each delayed the
    /// pulses; saturating.
    pub late_ticks: u16,
}

/// Report of the motor drivers.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverReport {
    /// Time on the board's clock.
    pub time: Micros,
    /// Reading of each motor's driver.
    pub motors: MotorList<DriverReading>,
}

/// Readings of a motor driver: warnings, for which the board does not stop.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriverReading {
    /// Whether the driver is hot: its prewarning of temperature, at 120 °C as delivered.
    pub is_hot: bool,
    /// Whether a coil seems to be open, while the motor turns. A hint only: fast motion may cause
    /// it.
    pub has_open_load: bool,
    /// Whether the last replies that it should have sent were damaged or did not come.
    pub has_lost_replies: bool,
    /// Reading of StallGuard, 0 to 510: lower at a higher load. `None` before the first one, and
    /// with [`SpreadCycle`](crate::wiring::Chopper::SpreadCycle).
    pub stall_guard: Option<u16>,
}

impl DriverReading {
    /// Returns whether this has a warning.
    pub const fn has_warning(&self) -> bool {
        self.is_hot || self.has_open_load || self.has_lost_replies
    }
}

/// Report that the board has stopped by itself.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultReport {
    /// Time of the fault on the board's clock.
    pub time: Micros,
    /// Reason.
    pub fault: Fault,
    /// See [`Telemetry::configuration`].
    pub configuration: Option<u16>,
}
