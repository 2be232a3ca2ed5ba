//! Wiring and configuration in flash: two slots in turn, so that a loss of power during a write
//! leaves the other one.
//!
//! A slot has a record of two pages. Each begins with a frame as on the wire
//! ([`plumb_protocol::frame`]): the configuration, then the wiring. Their CRCs distinguish a whole
//! record from a torn one, and their schema a record of this version from others. Both have the
//! number of the record, so that a wiring never goes with another configuration.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use heapless::Vec;
use plumb_protocol::frame::{Accumulator, MAX_FRAME, encode};
use plumb_protocol::{Config, SCHEMA, Wiring};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What a board needs before it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stored {
    /// The wiring.
    pub wiring: Wiring,
    /// The configuration.
    pub config: Config,
}

/// Content of a page.
#[derive(Serialize, Deserialize)]
struct Page<T> {
    schema: [u8; 8],
    /// Number of the record, one more than the last; wraps.
    sequence: u32,
    content: T,
}

/// Content of a slot.
struct Record {
    sequence: u32,
    stored: Stored,
}

/// Size of a page, bytes.
const PAGE: u32 = MAX_FRAME as u32;

/// Store of two slots: the offsets of two blocks that can be erased each alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigStore(pub [u32; 2]);

/// Error of a write. The configuration that was stored before is still there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreError;

impl ConfigStore {
    /// Returns what was stored last; `None` where there is nothing of this version.
    pub fn load(&self, flash: &mut impl ReadNorFlash) -> Option<Stored> {
        self.newest(flash).map(|(_, record)| record.stored)
    }

    /// Stores `wanted`. Blocks until it is written and read back; writes nothing where it is stored
    /// already.
    ///
    /// # Errors
    /// [`StoreError`] where the flash fails, or reads back something else.
    pub fn save<F: NorFlash>(&self, flash: &mut F, wanted: &Stored) -> Result<(), StoreError> {
        let newest = self.newest(flash);
        if newest.as_ref().is_some_and(|(_, record)| record.stored == *wanted) {
            return Ok(());
        }
        let (slot, sequence) =
            newest.map_or((0, 0), |(slot, record)| (1 - slot, record.sequence.wrapping_add(1)));
        let offset = self.0[slot];
        flash.erase(offset, offset + F::ERASE_SIZE as u32).map_err(|_| StoreError)?;
        write(flash, offset, sequence, wanted.config)?;
        write(flash, offset + PAGE, sequence, wanted.wiring)?;
        let is_written = |r: Record| r.sequence == sequence && r.stored == *wanted;
        if self.read(flash, slot).is_some_and(is_written) { Ok(()) } else { Err(StoreError) }
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
        let offset = self.0[slot];
        let config: Page<Config> = read(flash, offset)?;
        let wiring: Page<Wiring> = read(flash, offset + PAGE)?;
        let stored = Stored { wiring: wiring.content, config: config.content };
        let sequence = config.sequence;
        (wiring.sequence == sequence).then_some(Record { sequence, stored })
    }
}

/// Writes a page.
fn write<T: Serialize>(
    flash: &mut impl NorFlash,
    offset: u32,
    sequence: u32,
    content: T,
) -> Result<(), StoreError> {
    let mut page: Vec<u8, MAX_FRAME> =
        encode(&Page { schema: SCHEMA, sequence, content }).map_err(|_| StoreError)?;
    page.resize(MAX_FRAME, u8::MAX).map_err(|_| StoreError)?;
    flash.write(offset, &page).map_err(|_| StoreError)
}

/// Reads a page; `None` where it is not whole, or of another version.
#[cold]
fn read<T: DeserializeOwned>(flash: &mut impl ReadNorFlash, offset: u32) -> Option<Page<T>> {
    let mut bytes = [0; MAX_FRAME];
    flash.read(offset, &mut bytes).ok()?;
    let mut accumulator = Accumulator::new();
    let page: Page<T> = bytes.iter().find_map(|&byte| accumulator.push(byte))?.ok()?;
    (page.schema == SCHEMA).then_some(page)
}
