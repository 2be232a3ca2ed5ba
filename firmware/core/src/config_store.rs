//! The configuration in flash: two slots in turn, so that a loss of power during a write leaves the
//! other one.
//!
//! A slot begins with a frame as on the wire ([`plumb_protocol::frame`]). Its CRC distinguishes
//! a whole record from a torn one, and its schema a record of this version from others.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use heapless::Vec;
use plumb_protocol::frame::{Accumulator, MAX_FRAME, encode};
use plumb_protocol::{Config, SCHEMA};
use serde::{Deserialize, Serialize};

/// Content of a slot.
#[derive(Clone, Serialize, Deserialize)]
struct Record {
    schema: [u8; 8],
    /// Number of the record, one more than the last; wraps.
    sequence: u32,
    config: Config,
}

/// Store of two slots: the offsets of two blocks that can be erased each alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigStore(pub [u32; 2]);

/// Error of a write. The configuration that was stored before is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreError;

impl ConfigStore {
    /// Returns the configuration that was stored last; `None` where there is none of this version.
    pub fn load(&self, flash: &mut impl ReadNorFlash) -> Option<Config> {
        self.newest(flash).map(|(_, record)| record.config)
    }

    /// Stores `config`. Blocks until it is written and read back; writes nothing where it is stored
    /// already.
    ///
    /// # Errors
    /// [`StoreError`] where the flash fails, or reads back something else.
    pub fn save<F: NorFlash>(&self, flash: &mut F, config: &Config) -> Result<(), StoreError> {
        let newest = self.newest(flash);
        if newest.as_ref().is_some_and(|(_, record)| record.config == *config) {
            return Ok(());
        }
        let (slot, sequence) =
            newest.map_or((0, 0), |(slot, record)| (1 - slot, record.sequence.wrapping_add(1)));
        let offset = self.0[slot];
        let mut page: Vec<u8, MAX_FRAME> =
            encode(&Record { schema: SCHEMA, sequence, config: *config })
                .map_err(|_| StoreError)?;
        page.resize(MAX_FRAME, u8::MAX).map_err(|_| StoreError)?;
        flash.erase(offset, offset + F::ERASE_SIZE as u32).map_err(|_| StoreError)?;
        flash.write(offset, &page).map_err(|_| StoreError)?;
        let written =
            self.read(flash, slot).is_some_and(|r| r.sequence == sequence && r.config == *config);
        if written { Ok(()) } else { Err(StoreError) }
    }

    /// Returns the newer of the two records, with its slot.
    #[cold]
    fn newest(&self, flash: &mut impl ReadNorFlash) -> Option<(usize, Record)> {
        let [a, b] = [0, 1].map(|slot| self.read(flash, slot).map(|record| (slot, record)));
        match (a, b) {
            (Some(a), Some(b)) if (b.1.sequence.wrapping_sub(a.1.sequence) as i32) > 0 => Some(b),
            (a, b) => a.or(b),
        }
    }

    /// Returns the record of a slot, where it is whole and of this version.
    #[cold]
    fn read(&self, flash: &mut impl ReadNorFlash, slot: usize) -> Option<Record> {
        let mut page = [0; MAX_FRAME];
        flash.read(self.0[slot], &mut page).ok()?;
        let mut accumulator = Accumulator::new();
        let record: Record = page.iter().find_map(|&byte| accumulator.push(byte))?.ok()?;
        (record.schema == SCHEMA).then_some(record)
    }
}
