//! Packets of RTPS that nobody sends by mistake, for tests (RTPS 2.5, 9.4).

/// Entity of every reader.
pub(crate) const EVERY_READER: [u8; 4] = [0; 4];
/// Entity of the writer of participants.
pub(crate) const PARTICIPANTS: [u8; 4] = [0, 1, 0, 0xc2];
/// Reader of participants.
pub(crate) const PARTICIPANT_READER: [u8; 4] = [0, 1, 0, 0xc7];
/// Writer of publishers.
pub(crate) const PUBLISHERS: [u8; 4] = [0, 0, 3, 0xc2];
/// Reader of publishers.
pub(crate) const PUBLISHER_READER: [u8; 4] = [0, 0, 3, 0xc7];
/// A writer of an application.
pub(crate) const WRITER: [u8; 4] = [0, 0, 1, 3];

/// Fragments of a sample.
#[derive(Clone, Copy)]
pub(crate) struct Fragment {
    pub(crate) reader: [u8; 4],
    pub(crate) writer: [u8; 4],
    pub(crate) number: u32,
    /// First fragment, counted from 1.
    pub(crate) first: u32,
    pub(crate) size: u16,
    pub(crate) sample: u32,
}

/// Returns the beginning of the identity of participant `k`.
pub(crate) fn prefix(k: u32) -> [u8; 12] {
    let mut prefix = [7; 12];
    prefix[..4].copy_from_slice(&k.to_be_bytes());
    prefix
}

/// Returns a packet of participant `sender`, little-endian, with parts of a kind, flags and bytes.
pub(crate) fn packet(sender: u32, parts: &[(u8, u8, Vec<u8>)]) -> Vec<u8> {
    let mut packet = b"RTPS\x02\x03\x01\x10".to_vec();
    packet.extend(prefix(sender));
    for (kind, flags, body) in parts {
        packet.extend([*kind, flags | 1]);
        packet.extend(u16::try_from(body.len()).unwrap_or_default().to_le_bytes());
        packet.extend(body);
    }
    packet
}

/// Returns the number of a sample.
pub(crate) fn number(number: i64) -> [u8; 8] {
    let [high @ .., _, _, _, _] = number.to_be_bytes();
    let [_, _, _, _, low @ ..] = number.to_be_bytes();
    let (high, low) = (u32::from_be_bytes(high), u32::from_be_bytes(low));
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&high.to_le_bytes());
    bytes[4..].copy_from_slice(&low.to_le_bytes());
    bytes
}

/// Returns a list of parameters with its encapsulation.
pub(crate) fn parameters(list: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = vec![0, 3, 0, 0];
    for (name, value) in list {
        bytes.extend(name.to_le_bytes());
        bytes.extend(u16::try_from(value.len()).unwrap_or_default().to_le_bytes());
        bytes.extend(value);
    }
    bytes.extend([1, 0, 0, 0]);
    bytes
}

/// Returns a sample in one piece, or the key of one that has gone.
pub(crate) fn data(
    reader: [u8; 4],
    writer: [u8; 4],
    is_sample: bool,
    payload: &[u8],
) -> (u8, u8, Vec<u8>) {
    let head = [&[0, 0, 16, 0][..], &reader, &writer, &number(1), payload];
    (0x15, if is_sample { 4 } else { 8 }, head.concat())
}

/// Returns the announcement of `participant` by `sender`, with a lease of so many seconds.
pub(crate) fn announcement(sender: u32, participant: u32, lease: u32) -> Vec<u8> {
    let guid = [&prefix(participant)[..], &[0, 0, 1, 0xc1]].concat();
    let locator = |port: u32| {
        let address = [&[0; 12][..], &[127, 0, 0, 1]].concat();
        [&1_u32.to_le_bytes()[..], &port.to_le_bytes(), &address].concat()
    };
    let list = [
        (0x15, vec![2, 3, 0, 0]),
        (0x16, vec![1, 16, 0, 0]),
        (0x50, guid),
        (0x58, 0x0c3f_u32.to_le_bytes().to_vec()),
        (0x02, [lease.to_le_bytes(), [0; 4]].concat()),
        // Ports on which nobody listens.
        (0x32, locator(9)),
        (0x31, locator(9)),
    ];
    let payload = parameters(&list);
    packet(sender, &[data(EVERY_READER, PARTICIPANTS, true, &payload)])
}

/// Returns a packet with a fragment of a sample.
pub(crate) fn fragment(sender: u32, it: Fragment) -> Vec<u8> {
    let Fragment { reader, writer, number: at, first, size, sample } = it;
    let mut body = [&[0, 0, 28, 0][..], &reader, &writer, &number(at.into())].concat();
    body.extend(first.to_le_bytes());
    body.extend([1, 0]);
    body.extend(size.to_le_bytes());
    body.extend(sample.to_le_bytes());
    body.extend([0; 56]);
    packet(sender, &[(0x16, 0, body)])
}

/// Returns a packet that says of two ends of a range of samples: a HEARTBEAT (7) or a GAP (8).
pub(crate) fn range(sender: u32, kind: u8, ends: [i64; 2]) -> Vec<u8> {
    let [first, last] = ends.map(number);
    let body = [&PUBLISHER_READER[..], &PUBLISHERS, &first, &last, &[1, 0, 0, 0]].concat();
    packet(sender, &[(kind, 0, body)])
}
