//! The conversation with the host, and the last request that was carried out, so that a repetition
//! is not carried out again.

use plumb_protocol::message::{Hello, Refusal, Request, StartCause};
use plumb_protocol::provenance::Provenance;
use plumb_protocol::units::Micros;

/// Late ticks within [`SECOND_US`] that the board still goes on after: each delays the pulses by
/// some µs, and loses none.
pub(super) const MAX_LATE_TICKS: u8 = 10;
const SECOND_US: u64 = 1_000_000;

/// State of the conversation with the host.
#[derive(Debug)]
pub(super) struct Session {
    /// Frames that were torn, corrupted, overlong or not a command, since the start; saturating.
    pub(super) bad_frames: u16,
    /// Ticks since the start that came late while motors turned; saturates.
    pub(super) late_ticks: u16,
    /// The same within the second that began then.
    late_in_second: u8,
    second: Micros,
    /// Whether the last Hello matched.
    pub(super) greeted: bool,
    /// Whether a Hello has matched since the start.
    pub(super) was_greeted: bool,
    /// When the last intact command came.
    pub(super) last_rx: Micros,
    /// When telemetry was sent last.
    pub(super) last_telemetry: Micros,
    /// Why the board has started.
    pub(super) start_cause: StartCause,
    /// The board's program and chip.
    pub(super) provenance: Provenance,
    /// Id of a Diagnose command that is not answered.
    pub(super) diagnosis: Option<u16>,
    /// Id of an accepted Measure command that is not answered.
    pub(super) measurement: Option<u16>,
    /// Last request that was carried out, of those that are carried out once, since the last
    /// matching Hello.
    pub(super) last_request: Option<RequestKey>,
    /// Id of the Configure command in force; `None` where it was of an earlier session.
    pub(super) configuration: Option<u16>,
    /// Sequence number of the last accepted position.
    pub(super) sequence: Option<u16>,
}

impl Session {
    /// Creates the session of a board that has just started.
    pub(super) fn new() -> Self {
        Self {
            bad_frames: 0,
            late_ticks: 0,
            late_in_second: 0,
            second: Micros(0),
            greeted: false,
            was_greeted: false,
            last_rx: Micros(0),
            last_telemetry: Micros(0),
            start_cause: StartCause::PowerOn,
            provenance: Provenance::EMULATED,
            diagnosis: None,
            measurement: None,
            last_request: None,
            configuration: None,
            sequence: None,
        }
    }

    /// Counts a late tick, and returns how many there were within a second.
    pub(super) fn count_late_tick(&mut self, now: Micros) -> u8 {
        self.late_ticks = self.late_ticks.saturating_add(1);
        if now.since(self.second) >= SECOND_US {
            (self.second, self.late_in_second) = (now, 0);
        }
        self.late_in_second = self.late_in_second.saturating_add(1);
        self.late_in_second
    }

    /// Takes in a Hello and returns whether it matches. A matching one begins a new session: the
    /// host counts its positions and its requests anew.
    pub(super) fn greet(&mut self, hello: Hello) -> bool {
        self.greeted = hello == Hello::OURS;
        if self.greeted {
            self.was_greeted = true;
            (self.sequence, self.configuration, self.last_request) = (None, None, None);
        }
        self.greeted
    }

    /// Checks that a matching Hello has come.
    ///
    /// # Errors
    /// [`Refusal::NotGreeted`].
    pub(super) fn require_greeting(&self) -> Result<(), Refusal> {
        if self.greeted { Ok(()) } else { Err(Refusal::NotGreeted) }
    }

    /// Checks that `sequence` is newer than that of the last accepted position. The numbers wrap.
    ///
    /// # Errors
    /// [`Refusal::PositionOutOfOrder`].
    pub(super) fn check_order(&self, sequence: u16) -> Result<(), Refusal> {
        let newer = |last: u16| sequence.wrapping_sub(last) as i16 > 0;
        if self.sequence.is_none_or(newer) { Ok(()) } else { Err(Refusal::PositionOutOfOrder) }
    }
}

/// Id and CRC of a request: a repetition has both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RequestKey {
    pub(super) id: u16,
    pub(super) crc: u32,
}

impl RequestKey {
    /// Returns the key of a request.
    pub(super) fn of(request: &Request) -> Self {
        Self { id: request.message.id, crc: request.crc }
    }
}
