//! Packets of RTPS, as far as the gate must understand them (RTPS 2.5, 8.3 and 9.4).

/// First 12 bytes of the identities of a participant and of everything that it has.
pub(super) type Prefix = [u8; 12];

/// Last 4 bytes of an identity: which part of a participant it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Entity(pub(super) [u8; 4]);

impl Entity {
    /// Every reader that knows the writer.
    pub(super) const UNKNOWN: Self = Self([0; 4]);

    /// Returns whether it belongs to the protocol and not to an application (RTPS 2.5, 9.3.1.2).
    pub(super) fn is_builtin(self) -> bool {
        self.0[3] & 0xf0 != 0
    }
}

/// Returns whether what goes from `writer` to `reader` is about participants.
pub(super) fn is_of_participants(reader: Entity, writer: Entity) -> bool {
    const READER: Entity = Entity([0, 1, 0, 0xc7]);
    const WRITER: Entity = Entity([0, 1, 0, 0xc2]);
    reader == READER || reader == Entity::UNKNOWN && writer == WRITER
}

/// Part of a packet that the gate looks at.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Submessage<'a> {
    Data(Data<'a>),
    DataFragments(Fragments),
    /// Range of samples that a writer has, both ends included.
    Heartbeat {
        first: i64,
        last: i64,
    },
    /// Range of samples that a writer no longer has; the end is not included.
    Gap {
        start: i64,
        end: i64,
    },
    /// Fragments that are asked for.
    FragmentRequest {
        first: u32,
    },
    /// Another participant as the source of what follows.
    InfoSource,
    /// The one participant for which what follows is.
    InfoDestination,
    /// One that holds nothing with a bound.
    Other,
}

/// Sample in one piece.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Data<'a> {
    pub(super) reader: Entity,
    pub(super) writer: Entity,
    /// Whether the payload is a sample, and not the key of one that has gone.
    pub(super) is_sample: bool,
    /// Parameters before the payload, of the packet's byte order; empty where there are none.
    inline: Parameters<'a>,
    pub(super) payload: &'a [u8],
    /// Those parameters and the payload.
    pub(super) contents: &'a [u8],
}

/// Fragments of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fragments {
    pub(super) reader: Entity,
    pub(super) writer: Entity,
    pub(super) number: i64,
    /// First fragment, counted from 1.
    pub(super) first: u32,
    pub(super) count: u16,
    /// Bytes of a fragment.
    pub(super) size: u16,
    /// Bytes of the whole sample.
    pub(super) sample: u32,
}

/// Identifiers of parameters (RTPS 2.5, 9.6.3).
pub(super) mod parameter {
    pub(in super::super) const LEASE: u16 = 0x0002;
    pub(in super::super) const PARTICIPANT: u16 = 0x0050;
    pub(in super::super) const ENDPOINT: u16 = 0x005a;
    pub(in super::super) const KEY_HASH: u16 = 0x0070;
    pub(super) const SENTINEL: u16 = 0x0001;
}

/// Bytes with numbers of one byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fields<'a> {
    bytes: &'a [u8],
    is_little: bool,
}

impl Fields<'_> {
    fn array<const N: usize>(self, at: usize) -> Option<[u8; N]> {
        self.bytes.get(at..)?.first_chunk().copied()
    }

    fn u16(self, at: usize) -> Option<u16> {
        let bytes = self.array(at)?;
        Some(if self.is_little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn u32(self, at: usize) -> Option<u32> {
        let bytes = self.array(at)?;
        Some(if self.is_little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn entity(self, at: usize) -> Option<Entity> {
        self.array(at).map(Entity)
    }

    /// Returns the number of a sample; `None` above 2^47, which no writer reaches, and where the
    /// DDS library's sums could overflow.
    fn sample_number(self, at: usize) -> Option<i64> {
        let (high, low) = (self.u32(at)?, self.u32(at + 4)?);
        (high < 1 << 15).then(|| i64::from(high) << 32 | i64::from(low))
    }
}

/// List of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Parameters<'a>(Fields<'a>);

impl<'a> Parameters<'a> {
    /// Returns the parameters of a payload with its encapsulation; `None` where it has none.
    pub(super) fn of_payload(payload: &'a [u8]) -> Option<Self> {
        let (&[0, encoding @ (2 | 3), _, _], bytes) = payload.split_first_chunk()? else {
            return None;
        };
        Some(Self(Fields { bytes, is_little: encoding == 3 }))
    }

    /// Returns the parameters, up to the end of the list or of the bytes.
    fn all(self) -> impl Iterator<Item = (u16, Fields<'a>)> {
        let Self(Fields { mut bytes, is_little }) = self;
        std::iter::from_fn(move || {
            let head = Fields { bytes, is_little };
            let (name, length) = (head.u16(0)?, usize::from(head.u16(2)?));
            let value = bytes.get(4..4 + length)?;
            bytes = &bytes[4 + length..];
            (name != parameter::SENTINEL).then_some((name, Fields { bytes: value, is_little }))
        })
    }

    /// Returns whether the parameter `name` is there, and begins with `prefix` wherever it is.
    pub(super) fn is_of(self, name: u16, prefix: &Prefix) -> bool {
        self.all().any(|(it, _)| it == name) && !self.names_other(name, prefix)
    }

    /// Returns whether the parameter `name` is there with another beginning.
    pub(super) fn names_other(self, name: u16, prefix: &Prefix) -> bool {
        self.all().any(|(it, value)| it == name && !value.bytes.starts_with(prefix))
    }

    /// Returns the longest lease in the list, seconds.
    pub(super) fn lease(self) -> Option<u32> {
        let leases = self.all().filter(|(name, _)| *name == parameter::LEASE);
        leases.filter_map(|(_, value)| value.u32(0)).max()
    }

    /// Returns the bytes up to the end of the list, and those after it.
    fn split(fields: Fields<'a>) -> Option<(Self, &'a [u8])> {
        let mut at = 0;
        loop {
            let (name, length) = (fields.u16(at)?, usize::from(fields.u16(at + 2)?));
            if name == parameter::SENTINEL {
                let (list, rest) = fields.bytes.split_at_checked(at + 4)?;
                return Some((Self(Fields { bytes: list, ..fields }), rest));
            }
            at += 4 + length;
        }
    }
}

impl Data<'_> {
    /// Returns whether it says that the participant `prefix` has gone.
    pub(super) fn is_end_of(&self, prefix: &Prefix) -> bool {
        if self.is_sample || !is_of_participants(self.reader, self.writer) {
            return false;
        }
        match Parameters::of_payload(self.payload) {
            Some(key) => key.is_of(parameter::PARTICIPANT, prefix),
            None => self.inline.is_of(parameter::KEY_HASH, prefix),
        }
    }
}

/// Returns the prefix of the sender of a packet; `None` where it is no packet of RTPS.
pub(super) fn sender(packet: &[u8]) -> Option<Prefix> {
    let header: &[u8; 20] = packet.first_chunk()?;
    header.last_chunk().copied().filter(|_| header.starts_with(b"RTPS"))
}

/// Returns the parts of a packet after its header; an item is `None`, and the last one, where it is
/// damaged.
pub(super) fn submessages(packet: &[u8]) -> impl Iterator<Item = Option<Submessage<'_>>> {
    let mut rest = packet.get(20..).unwrap_or_default();
    std::iter::from_fn(move || {
        (!rest.is_empty()).then(|| {
            let found = next(rest);
            rest = found.as_ref().map_or(&[][..], |(_, rest)| *rest);
            found.map(|(submessage, _)| submessage)
        })
    })
}

/// Returns the first part of `bytes`, and the bytes after it.
fn next(bytes: &[u8]) -> Option<(Submessage<'_>, &[u8])> {
    const PAD: u8 = 0x01;
    const TIME: u8 = 0x09;
    let (&[kind, flags, ..], _) = bytes.split_first_chunk::<4>()?;
    let is_little = flags & 1 != 0;
    let length = Fields { bytes, is_little }.u16(2)?;
    let bytes = &bytes[4..];
    let length = match (length, kind) {
        (0, PAD | TIME) => 0,
        (0, _) => bytes.len(),
        (length, _) => usize::from(length),
    };
    let (body, rest) = bytes.split_at_checked(length)?;
    Some((read(kind, flags, Fields { bytes: body, is_little })?, rest))
}

/// Reads a part of a packet.
fn read(kind: u8, flags: u8, body: Fields<'_>) -> Option<Submessage<'_>> {
    Some(match kind {
        // ACKNACK
        0x06 => {
            body.sample_number(8)?;
            Submessage::Other
        }
        0x07 => {
            let (first, last) = (body.sample_number(8)?, body.sample_number(16)?);
            Submessage::Heartbeat { first, last }
        }
        0x08 => Submessage::Gap { start: body.sample_number(8)?, end: body.sample_number(16)? },
        0x0c => Submessage::InfoSource,
        0x0e => Submessage::InfoDestination,
        0x12 => {
            body.sample_number(8)?;
            Submessage::FragmentRequest { first: body.u32(16)? }
        }
        // HEARTBEAT_FRAG
        0x13 => {
            body.sample_number(8)?;
            Submessage::Other
        }
        0x15 => Submessage::Data(data(flags, body)?),
        0x16 => Submessage::DataFragments(Fragments {
            reader: body.entity(4)?,
            writer: body.entity(8)?,
            number: body.sample_number(12)?,
            first: body.u32(20)?,
            count: body.u16(24)?,
            size: body.u16(26)?,
            sample: body.u32(28)?,
        }),
        _ => Submessage::Other,
    })
}

/// Reads a sample in one piece.
fn data(flags: u8, body: Fields<'_>) -> Option<Data<'_>> {
    const INLINE: u8 = 2;
    const SAMPLE: u8 = 4;
    body.sample_number(12)?;
    let rest = body.bytes.get(4 + usize::from(body.u16(2)?)..)?;
    let rest = Fields { bytes: rest, ..body };
    let none = (Parameters(Fields { bytes: &[], ..body }), rest.bytes);
    let (inline, payload) = if flags & INLINE == 0 { none } else { Parameters::split(rest)? };
    let (reader, writer) = (body.entity(4)?, body.entity(8)?);
    let (is_sample, contents) = (flags & SAMPLE != 0, rest.bytes);
    Some(Data { reader, writer, is_sample, inline, payload, contents })
}
