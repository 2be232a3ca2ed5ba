//! A configuration kept in flash: in two slots by turns, so that a loss of power while one is
//! written leaves the other.
//!
//! A slot begins with a frame as on the wire ([`plumb_protocol::frame`]): its CRC tells a whole
//! record from a torn one, and the schema in it one of this version from any other.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use heapless::Vec;
use plumb_protocol::frame::{Accumulator, MAX_FRAME, encode};
use plumb_protocol::{Config, SCHEMA};
use serde::{Deserialize, Serialize};

/// What a slot holds.
#[derive(Clone, Serialize, Deserialize)]
struct Record {
    schema: [u8; 8],
    /// One more than the record before; wraps.
    sequence: u32,
    config: Config,
}

/// Where the slots are: offsets of two blocks that are erased apart from each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigStore(pub [u32; 2]);

/// The configuration was not written. What was kept before still is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreError;

impl ConfigStore {
    /// The configuration that was kept last; `None` where there is none of this version.
    pub fn load(&self, flash: &mut impl ReadNorFlash) -> Option<Config> {
        self.newest(flash).map(|(_, record)| record.config)
    }

    /// Keeps `config`. Blocks until it is written and read back; writes nothing where it is kept
    /// already.
    ///
    /// # Errors
    /// Where the flash fails, or does not hold what was written.
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
        let kept =
            self.read(flash, slot).is_some_and(|r| r.sequence == sequence && r.config == *config);
        if kept { Ok(()) } else { Err(StoreError) }
    }

    /// The newer of the slots' records, and which slot it is in.
    fn newest(&self, flash: &mut impl ReadNorFlash) -> Option<(usize, Record)> {
        let [a, b] = [0, 1].map(|slot| self.read(flash, slot).map(|record| (slot, record)));
        match (a, b) {
            (Some(a), Some(b)) if (b.1.sequence.wrapping_sub(a.1.sequence) as i32) > 0 => Some(b),
            (a, b) => a.or(b),
        }
    }

    /// A slot's record, if it is whole and of this version.
    fn read(&self, flash: &mut impl ReadNorFlash, slot: usize) -> Option<Record> {
        let mut page = [0; MAX_FRAME];
        flash.read(self.0[slot], &mut page).ok()?;
        let mut accumulator = Accumulator::new();
        let record: Record = page.iter().find_map(|&byte| accumulator.push(byte))?.ok()?;
        (record.schema == SCHEMA).then_some(record)
    }
}
