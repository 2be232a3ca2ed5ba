//! Records of an `.oni` file: their headers, and the values in their fields.

/// Most bytes of a name, with its final zero.
const MAX_NAME: usize = 256;

/// Rest of a record's fields. Each method takes a value from their beginning; `None` where the
/// value does not fit.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    /// Takes the next `count` bytes.
    pub(super) fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    /// Takes a 32-bit number.
    pub(super) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.bytes(4)?.try_into().ok()?))
    }

    /// Takes a 64-bit number.
    pub(super) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.bytes(8)?.try_into().ok()?))
    }

    /// Takes a name: printable, with its final zero.
    pub(super) fn name(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.u32()?).ok().filter(|length| *length <= MAX_NAME)?;
        let (zero, name) = self.bytes(length)?.split_last()?;
        (*zero == 0 && !name.is_empty() && name.iter().all(|c| c.is_ascii_graphic() || *c == b' '))
            .then_some(name)
    }

    /// Checks that no bytes are left.
    pub(super) fn end(&self) -> Option<()> {
        self.0.is_empty().then_some(())
    }
}

/// First bytes of a record.
pub(super) const RECORD_MAGIC: &[u8; 4] = b"NIR\0";
/// Bytes of a record's header.
pub(super) const RECORD_HEADER: u64 = 28;
/// Most bytes of a record's header and fields. Fields are names and properties.
const MAX_FIELDS: u64 = 1 << 16;

/// Types of records. A node is a stream.
pub(super) const NUMBER: u32 = 3;
pub(super) const REAL: u32 = 4;
pub(super) const TEXT: u32 = 5;
pub(super) const GENERAL: u32 = 6;
pub(super) const NODE_REMOVED: u32 = 7;
pub(super) const DATA_BEGINS: u32 = 8;
pub(super) const READY: u32 = 9;
pub(super) const NEW_DATA: u32 = 10;
pub(super) const END: u32 = 11;
pub(super) const NODE_ADDED: u32 = 13;
pub(super) const INDEX: u32 = 14;

/// Header of a record.
pub(super) struct Record {
    /// Type of the record.
    pub(super) kind: u32,
    /// Number of the stream.
    pub(super) node: u32,
    /// Bytes of header and fields.
    pub(super) fields: u64,
    /// Bytes behind the fields.
    pub(super) payload: u64,
    /// Position of the record that this one undoes, 0 for none.
    pub(super) undone: u64,
    /// Position of this record.
    pub(super) at: u64,
}

impl Record {
    /// Parses the header of the record at byte `at`; `None` where it is no record.
    pub(super) fn parse(header: &[u8; RECORD_HEADER as usize], at: u64) -> Option<Self> {
        let mut numbers = Fields(header.strip_prefix(RECORD_MAGIC)?);
        let [kind, node] = [numbers.u32()?, numbers.u32()?];
        let [fields, payload] = [numbers.u32()?, numbers.u32()?].map(u64::from);
        let undone = numbers.u64()?;
        let fits = (RECORD_HEADER..=MAX_FIELDS).contains(&fields);
        fits.then_some(Self { kind, node, fields, payload, undone, at })
    }

    /// Returns the position of the next record.
    pub(super) fn next(&self) -> u64 {
        self.at + self.fields + self.payload
    }
}
