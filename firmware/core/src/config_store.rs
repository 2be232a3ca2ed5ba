//! Wiring and configuration in flash, with what is known of the rig: two slots in turn, so that a
//! loss of power during a write leaves the other one.
//!
//! A slot has a record of two or three pages. Each begins with a frame as on the wire
//! ([`plumb_protocol::frame`]): the configuration, the wiring, and the known rig if there is one.
//! Their CRCs distinguish a whole record from a torn one, and their schema a record of this version
//! from others. All have the number of the record, so that a wiring never goes with another
//! configuration.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use heapless::Vec;
use plumb_protocol::frame::{Accumulator, MAX_FRAME, encode};
use plumb_protocol::{Config, SCHEMA, Wiring};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::law::KnownRig;

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
/// Offset of the wiring in a slot, bytes. The configuration is at its start.
const WIRING: u32 = PAGE;
/// Offset of the known rig in a slot, bytes.
const RIG: u32 = 2 * PAGE;

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

    /// Returns the rig that was stored with it; `None` where none was, or one of another version.
    #[cold]
    pub fn known_rig(&self, flash: &mut impl ReadNorFlash) -> Option<KnownRig> {
        let (slot, record) = self.newest(flash)?;
        let page: Page<KnownRig> = read(flash, self.0[slot] + RIG)?;
        (page.sequence == record.sequence && page.content.is_usable()).then_some(page.content)
    }

    /// Stores `wanted`, with the `known` rig if there is one. Waits until both are written and read
    /// back. Writes nothing if they are stored already.
    ///
    /// # Errors
    /// [`StoreError`] where the flash fails, or reads back something else.
    pub fn save<F: NorFlash>(
        &self,
        flash: &mut F,
        wanted: &Stored,
        known: Option<&KnownRig>,
    ) -> Result<(), StoreError> {
        let newest = self.newest(flash).map(|(slot, record)| (slot, record.sequence));
        if let Some((slot, sequence)) = newest
            && self.holds(flash, (slot, sequence), wanted, known)?
        {
            return Ok(());
        }
        let (slot, sequence) =
            newest.map_or((0, 0), |(slot, sequence)| (1 - slot, sequence.wrapping_add(1)));
        let offset = self.0[slot];
        flash.erase(offset, offset + F::ERASE_SIZE as u32).map_err(|_| StoreError)?;
        // The record is whole with its wiring, so the rig comes before that.
        if let Some(rig) = known {
            write(flash, offset + RIG, &page(sequence, rig)?)?;
        }
        write(flash, offset, &page(sequence, wanted.config)?)?;
        write(flash, offset + WIRING, &page(sequence, wanted.wiring)?)?;
        let is_written = self.holds(flash, (slot, sequence), wanted, known)?;
        if is_written { Ok(()) } else { Err(StoreError) }
    }

    /// Returns whether the record of a slot has this number, contains `wanted`, and contains the
    /// `known` rig if there is one.
    ///
    /// # Errors
    /// [`StoreError`] where the flash cannot be read.
    #[cold]
    #[inline(never)]
    fn holds(
        &self,
        flash: &mut impl ReadNorFlash,
        (slot, sequence): (usize, u32),
        wanted: &Stored,
        known: Option<&KnownRig>,
    ) -> Result<bool, StoreError> {
        let offset = self.0[slot];
        let has_rig = match known {
            Some(rig) => has(flash, offset + RIG, &page(sequence, rig)?)?,
            None => true,
        };
        Ok(has_rig
            && has(flash, offset, &page(sequence, wanted.config)?)?
            && has(flash, offset + WIRING, &page(sequence, wanted.wiring)?)?)
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
        let wiring: Page<Wiring> = read(flash, offset + WIRING)?;
        let stored = Stored { wiring: wiring.content, config: config.content };
        let sequence = config.sequence;
        (wiring.sequence == sequence).then_some(Record { sequence, stored })
    }
}

/// Returns the bytes of a page.
#[cold]
#[inline(never)]
fn page<T: Serialize>(sequence: u32, content: T) -> Result<Vec<u8, MAX_FRAME>, StoreError> {
    let mut page: Vec<u8, MAX_FRAME> =
        encode(&Page { schema: SCHEMA, sequence, content }).map_err(|_| StoreError)?;
    page.resize(MAX_FRAME, u8::MAX).map_err(|_| StoreError)?;
    Ok(page)
}

/// Writes a page.
#[cold]
fn write(flash: &mut impl NorFlash, offset: u32, page: &[u8]) -> Result<(), StoreError> {
    flash.write(offset, page).map_err(|_| StoreError)
}

/// Returns whether the page at `offset` is `page`.
#[cold]
#[inline(never)]
fn has(flash: &mut impl ReadNorFlash, offset: u32, page: &[u8]) -> Result<bool, StoreError> {
    let mut found = [0; MAX_FRAME];
    flash.read(offset, &mut found).map_err(|_| StoreError)?;
    Ok(found == page)
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
