//! Numbers and strings in the fields of a record.

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
