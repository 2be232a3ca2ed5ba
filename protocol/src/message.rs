//! The messages in both directions.

use postcard_schema::{Schema, key::Key};
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::units::{Covariance, Micrometres, Micros, Point, Rate, Steps16};

/// First bytes of every [`Hello`]: "PLMB".
pub const MAGIC: [u8; 4] = *b"PLMB";

/// Version of the protocol's meaning; the bytes are covered by [`SCHEMA`].
pub const VERSION: u16 = 2;

/// Identifies the messages' types on both sides: a hash of their schema, so any change of a message
/// changes it.
pub const SCHEMA: [u8; 8] = Key::for_path::<(ToBoard, FromBoard)>("plumb").to_bytes();

/// A command and the number that its answer carries.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ToBoard {
    /// Number of the request, chosen by the host and returned in [`Answer::id`]. Each new request
    /// has another number, 0 excepted. A request that is sent again keeps its number: see the
    /// [crate's front page](crate#order-loss-and-duplicates).
    pub id: u16,
    /// What is asked for.
    pub command: Command,
}

impl ToBoard {
    /// The position, where these bytes of postcard are a [`Command::Position`]: what a board waits
    /// for, without the room that the largest command takes.
    #[inline(always)]
    pub fn position(message: &[u8]) -> Option<PositionCommand> {
        /// Which one of the commands it is.
        const POSITION: u32 = 4;
        let mut reader = postcard::Deserializer::from_bytes(message);
        let id = u16::deserialize(&mut reader).ok()?;
        if u32::deserialize(&mut reader) != Ok(POSITION) {
            return None;
        }
        // By reference: what may also be an error is copied by the byte.
        match &Position::deserialize(&mut reader) {
            Ok(position) if reader.finalize().is_ok_and(<[u8]>::is_empty) => {
                Some(PositionCommand { id, position: *position })
            }
            _ => None,
        }
    }
}

/// A [`ToBoard`] with a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PositionCommand {
    /// See [`ToBoard::id`].
    pub id: u16,
    /// See [`Command::Position`].
    pub position: Position,
}

/// What a host can ask for. Grows at its end; the first three never change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Who is there? Comes first; until it matches, nothing moves.
    Hello(Hello),
    /// Ramp down and forget the target. Always obeyed.
    Stop,
    /// Ramp down, then restart into the chip's bootloader.
    Bootloader,
    /// Take these parameters; refused while moving.
    Configure(Config),
    /// Where the ball was seen.
    Position(Position),
    /// Drive the ball here.
    Target(Point),
    /// Turn one motor, for commissioning.
    Jog(Jog),
    /// Keep the ball where it is now.
    Hold,
    /// Leave the fault state, at standstill.
    ClearFault,
    /// Send telemetry now. Also the heartbeat of a host that has nothing else to say.
    Status,
    /// Keep the present configuration over a loss of power; refused while moving. The answer comes
    /// once it is written.
    Store,
}

/// One side's name and version. Its bytes never change.
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
    /// What this side says of itself.
    pub const OURS: Self = Self { magic: MAGIC, version: VERSION, schema: SCHEMA };
}

/// Where the ball was, in a picture taken `age_us` before this message was sent.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Number of the picture, counting up and wrapping.
    pub sequence: u16,
    /// From the middle of the exposure to the sending of this message, microseconds.
    pub age_us: u32,
    /// The ball's centre in the rig frame; `None` where the picture shows no ball.
    pub ball: Option<Point>,
    /// How sure that is; `None` where nobody knows, and the board takes what is usual for its law.
    pub covariance: Option<Covariance>,
}

/// A move of one motor on its own.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jog {
    /// 0 = A, 1 = B, 2 = C.
    pub motor: u8,
    /// How far from where it is now, + pays out.
    pub distance: Steps16,
    /// How fast at most; above 0.
    pub rate: Rate,
}

/// What a board says. Grows at its end; the first never changes.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromBoard {
    /// Answers a Hello.
    Hello(BoardHello),
    /// Answers any other command. Accepted positions have no answer: telemetry carries their
    /// sequence number.
    Answer(Answer),
    /// How things are; after every accepted position, and every 100 ms at least once greeted.
    Telemetry(Telemetry),
    /// The board has just stopped by itself.
    Fault(FaultReport),
    /// Follows an accepting Hello: why the board last started.
    Started(StartCause),
}

/// The board's name, what it was built with, and whether the host's Hello matched. Its bytes never
/// change.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardHello {
    /// The id of the host's Hello.
    pub id: u16,
    /// Magic, version and schema of the board.
    pub hello: Hello,
    /// Highest pulse rate of a motor that the board was built for, microsteps/s.
    pub max_pulse_rate: u32,
    /// Whether the board accepts this host; otherwise it will not move for it.
    pub accepted: bool,
}

/// Whether a command was carried out.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// The command's [`ToBoard::id`].
    pub id: u16,
    /// Why it was not; `None` where it was.
    pub refusal: Option<Refusal>,
    /// When the board answered, on the board's clock. Telemetry with a later
    /// [`time`](Telemetry::time) describes the board after the command.
    pub time: Micros,
}

/// Why a command was not carried out. Nothing has changed then, save what the variant says. Grows
/// at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// No matching Hello came before.
    NotGreeted,
    /// The frame was intact, but it is no command of this protocol version; `id` is 0.
    Malformed,
    /// Configure first.
    Unconfigured,
    /// Not in this state; Stop first and wait for standstill.
    Busy(State),
    /// The board has stopped by itself; clear that first.
    Faulted(Fault),
    /// This part of the configuration is out of its range.
    Config(ConfigField),
    /// The target is outside the workspace. A board under way has stopped with
    /// [`Fault::TargetOutside`].
    TargetOutside,
    /// The picture is older than [`max_age`](crate::config::Deadlines::max_age).
    PositionStale,
    /// A newer picture's position has come before.
    PositionOutOfOrder,
    /// The ball is outside the workspace. It is not used, and the board stops when it happens
    /// repeatedly.
    BallOutside,
    /// No position is known to hold.
    NoPosition,
    /// No such motor.
    NoSuchMotor,
    /// A jog without a rate, or faster than the motor's limit.
    JogRate,
    /// A jog beyond the motor's travel; of a motor that stands outside, one that does not lead
    /// back.
    JogTravel,
    /// This board cannot do that.
    Unsupported,
    /// The configuration could not be written; what was kept before still is.
    NotStored,
    /// This motor (0 = A, 1 = B, 2 = C) stands outside its travel; jog it back inside first.
    OutsideTravel(u8),
}

/// The part of a configuration that is out of its range.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConfigField {
    /// A sign other than -1, 0, +1, or a motor that moves nothing.
    Signs,
    /// α = 0, α > β or β above 8.
    Bounds,
    /// Gain 0 or above 16 steps/s a µm.
    Gain,
    /// A rate of 0 or above what the board was built for.
    MaxRate,
    /// Acceleration below 40 steps/s² or above 4 million.
    MaxAcceleration,
    /// A travel that does not contain 0.
    Travel,
    /// Microsteps other than 1, 2, 4, 8, 16.
    Microsteps,
    /// An empty workspace, or one beyond ±4 m.
    Workspace,
    /// A radius of 0 or above 1 m, or 0 frames.
    Reached,
    /// A deadline of 0, or one above 5 s.
    Deadlines,
    /// A margin or time of 0.
    Growth,
    /// A driver's pulse time above 4.1 µs, or a share of 0 or above 100 %.
    Drivers,
    /// A running mean over more than 400 ms.
    Mean,
    /// A delay above 500 ms.
    Delay,
    /// A law that this board has no time for; those of this version have it for every law.
    Law,
    /// A [`max_age`](crate::config::Deadlines::max_age) at or above the deadline for positions:
    /// positions older than the deadline would be accepted.
    MaxAge,
}

/// State of the board. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The board has no configuration.
    Unconfigured,
    /// The board is configured and its motors stand.
    Ready,
    /// The board drives the ball to its target.
    Seeking,
    /// The target was reached, and the board keeps the ball there.
    Holding,
    /// The board has stopped by itself: its motors ramp down or stand until the fault is cleared.
    Fault(Fault),
    /// The board turns one motor by an exact number of steps.
    Jogging,
    /// The motors ramp down; or the board restarts into its bootloader.
    Stopping,
    /// The board writes its configuration; the motors stand.
    Storing,
}

/// Why a board started. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartCause {
    /// It was given power, or its supply had sagged.
    PowerOn,
    /// Its reset pin was pulled.
    ResetPin,
    /// The watchdog restarted it: its program hung, or its stack overflowed.
    Watchdog,
    /// Its program found itself in error and restarted.
    Panic,
    /// The processor met an instruction or an address that it could not carry out.
    HardFault,
    /// It was restarted on purpose, as after an update.
    Requested,
}

/// Why a board stopped by itself. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing valid came from the host for too long.
    HostSilent,
    /// No fresh position came for too long.
    PositionLost,
    /// The ball was seen outside the workspace repeatedly.
    BallOutside,
    /// A target outside the workspace was asked for while under way.
    TargetOutside,
    /// A motor (0 = A, 1 = B, 2 = C) would have passed its travel.
    Travel(u8),
    /// |e| keeps growing: a motor is swapped or reversed, or the ball is held back.
    ErrorGrowing,
    /// The emergency input opened.
    EmergencyStop,
    /// The board restarted because of itself ([`StartCause`] says how): where its motors are is no
    /// longer known.
    Watchdog,
    /// The control law had no answer in time.
    LawLate,
}

/// How things are at a moment.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Telemetry {
    /// The moment, on the board's clock.
    pub time: Micros,
    /// The state.
    pub state: State,
    /// [`ToBoard::id`] of the Configure command in force; `None` where none was carried out since
    /// the last accepted Hello.
    pub configuration: Option<u16>,
    /// [`ToBoard::id`] of the Target or Hold command in force; `None` without a target. State,
    /// error and filtered error belong to this target.
    pub target: Option<u16>,
    /// Number of the last accepted position.
    pub sequence: Option<u16>,
    /// Motor positions since the board started.
    pub motors: [Steps16; 3],
    /// Motor rates.
    pub rates: [Rate; 3],
    /// e = position - target of the last accepted position; 0 without a target.
    pub error: Point,
    /// |e| of the filtered position; 0 without a target.
    pub filtered_error: Micrometres,
    /// Frames from the host that were torn, corrupted, overlong or not a command, since the start;
    /// saturating.
    pub bad_frames: u16,
}

/// The board has stopped by itself.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultReport {
    /// When, on the board's clock.
    pub time: Micros,
    /// Why.
    pub fault: Fault,
    /// See [`Telemetry::configuration`].
    pub configuration: Option<u16>,
}
