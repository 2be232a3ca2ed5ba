//! Which packets the DDS library may see: what they claim is bounded, one by one and together.

use std::collections::{HashMap, HashSet, VecDeque};
use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::time::{Duration, Instant};

use super::packet::{
    Data, Entity, Fragments, Parameters, Prefix, Submessage, is_of_participants, parameter, sender,
    submessages,
};

/// Most participants at a time. A program with ROS 2 is one.
pub(crate) const MAX_PARTICIPANTS: usize = 128;

/// Most announcements of publishers, subscriptions and services that the DDS library holds. It
/// keeps those of a participant that falls silent, in case it comes back.
const MAX_ANNOUNCEMENTS: usize = 8192;

/// Most writers of a participant that send in fragments.
const MAX_FRAGMENTING: usize = 256;

/// Most bytes of an announcement in fragments.
const MAX_ANNOUNCEMENT: u32 = 1 << 16;

/// Most samples of which one packet may say that they are there or have gone, and the last fragment
/// that may be asked for.
const MAX_RANGE: u32 = 1 << 16;

/// Fewest bytes of a fragment but that of a whole sample. RustDDS has 256, others more.
const MIN_FRAGMENT: u16 = 256;

/// Number of complete samples that are remembered. A repeated fragment would begin one anew.
const COMPLETE: usize = 64;

/// Bytes that an incomplete sample counts beside its own.
const OVERHEAD: u64 = 4096;

/// Silence after which the DDS library drops an incomplete sample, with the time until it looks.
const INCOMPLETE: Duration = Duration::from_secs(13);

/// Time that the DDS library may take to notice the end of a lease.
const NOTICE: Duration = Duration::from_secs(10);

/// Lease of a participant that names none, as in the DDS library.
const LEASE: Duration = Duration::from_secs(60);

/// Reason for which a packet is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Refusal {
    /// It is no packet, or a damaged one.
    Damaged,
    /// Its sender has not announced itself.
    Unannounced,
    /// There are too many participants.
    Participants,
    /// There are too many announcements.
    Announcements,
    /// It announces another participant's endpoint.
    Foreign,
    /// It claims a range of numbers that is too long.
    Range,
    /// It claims a sample that is too long, or fragments that are none.
    Sample,
    /// Together the incomplete samples are too long.
    Incomplete,
    /// It repeats a fragment of a sample that is complete.
    Repeated,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Damaged => "a damaged packet",
            Self::Unannounced => "a packet of a program that has not announced itself",
            Self::Participants => "a program beyond the first 128",
            Self::Announcements => "a publisher or subscription beyond the first 8192",
            Self::Foreign => "an announcement in the name of another program",
            Self::Range => "a range of messages that is too long",
            Self::Sample => "a message that is too long, or in pieces that are too short",
            Self::Incomplete => "pieces of more messages than may wait for their rest",
            Self::Repeated => "a piece of a message that is complete",
        })
    }
}

/// Participant that has announced itself.
struct Participant {
    /// End of its lease, with [`NOTICE`]. `None` for one that never ends.
    until: Option<Instant>,
    /// Fingerprints of its announcements.
    announcements: HashSet<u64>,
    /// Sizes of the fragments of its writers.
    fragments: HashMap<Entity, u16>,
}

/// Identity of a sample at a reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct SampleId {
    prefix: Prefix,
    reader: Entity,
    writer: Entity,
    number: i64,
}

/// Sample of which fragments are missing.
struct Incomplete {
    bytes: u32,
    /// Whether each fragment has come.
    has_come: Vec<bool>,
    /// Number of those that have not.
    missing: usize,
    last: Instant,
}

/// Judge of packets. It knows what the DDS library holds.
pub(crate) struct Guard {
    /// Most bytes of a sample. Twice as many may be incomplete.
    max_sample: u32,
    participants: HashMap<Prefix, Participant>,
    /// Announcements of participants that have fallen silent.
    left_behind: usize,
    incomplete: HashMap<SampleId, Incomplete>,
    /// Those that were complete last.
    complete: VecDeque<SampleId>,
    hash: RandomState,
}

impl Guard {
    pub(crate) fn new(max_sample: u32) -> Self {
        Self {
            max_sample,
            participants: HashMap::new(),
            left_behind: 0,
            incomplete: HashMap::new(),
            complete: VecDeque::new(),
            hash: RandomState::new(),
        }
    }

    /// Returns the bytes that incomplete samples claim, with what is beside them.
    pub(crate) fn claimed(&self) -> u64 {
        self.incomplete.values().map(|it| OVERHEAD + u64::from(it.bytes)).sum()
    }

    /// Judges a packet that came at `now`.
    ///
    /// # Errors
    /// The reason for which the DDS library must not see it.
    pub(crate) fn admit(&mut self, packet: &[u8], now: Instant) -> Result<(), Refusal> {
        let prefix = sender(packet).ok_or(Refusal::Damaged)?;
        let (mut is_end, mut is_for_all) = (false, true);
        for submessage in submessages(packet) {
            match submessage.ok_or(Refusal::Damaged)? {
                Submessage::Data(data) if data.is_end_of(&prefix) => is_end |= is_for_all,
                Submessage::Data(data) => self.data(&prefix, &data, now)?,
                Submessage::InfoDestination => is_for_all = false,
                Submessage::DataFragments(it) => self.fragments(&prefix, it, now)?,
                Submessage::Heartbeat { first, last } => range(first, last)?,
                // One from the first sample on costs nothing.
                Submessage::Gap { start: 0..=1, .. } | Submessage::Other => {}
                Submessage::Gap { start, end } => range(start, end)?,
                Submessage::FragmentRequest { first: 1..=MAX_RANGE } => {}
                Submessage::FragmentRequest { .. } => return Err(Refusal::Range),
                Submessage::InfoSource => return Err(Refusal::Foreign),
            }
        }
        // The DDS library remembers the way to every sender.
        let is_known = self.participants.contains_key(&prefix);
        if is_end {
            self.participants.remove(&prefix);
        }
        if is_known { Ok(()) } else { Err(Refusal::Unannounced) }
    }

    fn data(&mut self, prefix: &Prefix, data: &Data<'_>, now: Instant) -> Result<(), Refusal> {
        let Data { reader, writer, contents, .. } = *data;
        if is_of_participants(reader, writer) {
            return self.participant(prefix, data, now);
        }
        if is_mixed(reader, writer) {
            return Err(Refusal::Damaged);
        }
        if !writer.is_builtin() {
            return Ok(());
        }
        let list = Parameters::of_payload(data.payload);
        if list.is_some_and(|it| it.names_other(parameter::ENDPOINT, prefix)) {
            return Err(Refusal::Foreign);
        }
        self.announce(prefix, self.hash.hash_one((writer, contents)))
    }

    /// Notes an announcement of a participant.
    fn participant(
        &mut self,
        prefix: &Prefix,
        data: &Data<'_>,
        now: Instant,
    ) -> Result<(), Refusal> {
        let list = Parameters::of_payload(data.payload).ok_or(Refusal::Damaged)?;
        if !data.is_sample || !list.is_of(parameter::PARTICIPANT, prefix) {
            return Err(Refusal::Foreign);
        }
        let lease = list.lease().map_or(LEASE, |seconds| Duration::from_secs(seconds.into()));
        let until = now.checked_add(lease + NOTICE);
        if let Some(known) = self.participants.get_mut(prefix) {
            known.until = until;
            return Ok(());
        }
        if self.participants.len() >= MAX_PARTICIPANTS {
            self.forget_silent(now);
        }
        if self.participants.len() >= MAX_PARTICIPANTS {
            return Err(Refusal::Participants);
        }
        let (announcements, fragments) = (HashSet::new(), HashMap::new());
        self.participants.insert(*prefix, Participant { until, announcements, fragments });
        Ok(())
    }

    /// Forgets the participants whose lease has ended.
    fn forget_silent(&mut self, now: Instant) {
        let left_behind = &mut self.left_behind;
        self.participants.retain(|_, it| {
            let is_alive = it.until.is_none_or(|until| until > now);
            if !is_alive {
                *left_behind += it.announcements.len();
            }
            is_alive
        });
    }

    /// Notes an announcement with this fingerprint.
    fn announce(&mut self, prefix: &Prefix, fingerprint: u64) -> Result<(), Refusal> {
        let known = self.participants.values().map(|it| it.announcements.len());
        let count = self.left_behind + known.sum::<usize>();
        let sender = self.participants.get_mut(prefix).ok_or(Refusal::Unannounced)?;
        if !sender.announcements.contains(&fingerprint) {
            if count >= MAX_ANNOUNCEMENTS {
                return Err(Refusal::Announcements);
            }
            sender.announcements.insert(fingerprint);
        }
        Ok(())
    }

    fn fragments(&mut self, prefix: &Prefix, it: Fragments, now: Instant) -> Result<(), Refusal> {
        let Fragments { reader, writer, number, .. } = it;
        let is_builtin = writer.is_builtin();
        if is_mixed(reader, writer) || is_of_participants(reader, writer) {
            return Err(Refusal::Damaged);
        }
        let max_sample = if is_builtin { MAX_ANNOUNCEMENT } else { self.max_sample };
        let is_short = it.size < MIN_FRAGMENT && u32::from(it.size) < it.sample;
        if it.sample > max_sample || u32::from(it.size) > it.sample || is_short || it.size == 0 {
            return Err(Refusal::Sample);
        }
        self.writer(prefix, writer, it.size)?;
        if is_builtin {
            self.announce(prefix, self.hash.hash_one((writer, number)))?;
        }
        let id = SampleId { prefix: *prefix, reader, writer, number };
        self.sample(id, it, now)
    }

    /// Notes that a writer sends in fragments of `size`. The DDS library takes the first size for
    /// all of its samples.
    fn writer(&mut self, prefix: &Prefix, writer: Entity, size: u16) -> Result<(), Refusal> {
        let sender = self.participants.get_mut(prefix).ok_or(Refusal::Unannounced)?;
        let is_full = sender.fragments.len() >= MAX_FRAGMENTING;
        match sender.fragments.get(&writer) {
            Some(known) if *known != size => Err(Refusal::Sample),
            None if is_full => Err(Refusal::Incomplete),
            _ => {
                sender.fragments.insert(writer, size);
                Ok(())
            }
        }
    }

    /// Notes fragments of a sample that is or was incomplete.
    fn sample(&mut self, id: SampleId, it: Fragments, now: Instant) -> Result<(), Refusal> {
        let count = it.sample.div_ceil(it.size.into()) as usize;
        if self.complete.contains(&id) {
            return Err(Refusal::Repeated);
        }
        if !self.incomplete.contains_key(&id) {
            self.incomplete.retain(|_, it| now.saturating_duration_since(it.last) < INCOMPLETE);
            if self.claimed() + u64::from(it.sample) > 2 * u64::from(self.max_sample) {
                return Err(Refusal::Incomplete);
            }
            let has_come = vec![false; count];
            let new = Incomplete { bytes: it.sample, has_come, missing: count, last: now };
            self.incomplete.insert(id, new);
        }
        let known = self.incomplete.get_mut(&id).ok_or(Refusal::Incomplete)?;
        let first = (it.first as usize).checked_sub(1).ok_or(Refusal::Damaged)?;
        let come = known.has_come.get_mut(first..first + usize::from(it.count));
        let come = come.filter(|come| known.bytes == it.sample && !come.is_empty());
        for has_come in come.ok_or(Refusal::Damaged)? {
            known.missing -= usize::from(!std::mem::replace(has_come, true));
        }
        known.last = now;
        if known.missing == 0 {
            self.incomplete.remove(&id);
            self.complete.truncate(COMPLETE - 1);
            self.complete.push_front(id);
        }
        Ok(())
    }
}

/// Returns whether one side belongs to the protocol and the other to an application.
fn is_mixed(reader: Entity, writer: Entity) -> bool {
    reader != Entity::UNKNOWN && reader.is_builtin() != writer.is_builtin()
}

/// Checks that a range of samples is short.
fn range(first: i64, last: i64) -> Result<(), Refusal> {
    if last - first <= i64::from(MAX_RANGE) { Ok(()) } else { Err(Refusal::Range) }
}
