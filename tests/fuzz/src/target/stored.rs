//! Wiring and configuration in the board's flash.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use plumb_core::config_store::{ConfigStore, Stored};
use plumb_protocol::{Config, Wiring};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "stored",
    input: "the contents of the flash",
    run,
    max_length: 1600,
    smoke: 20_000,
    words: &["\0"],
};

/// Bytes of a sector. The firmware's have 4096; a record takes 768.
const SECTOR: usize = 768;

/// Flash of two sectors.
struct Flash([u8; 2 * SECTOR]);

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        let from = self.0.get(offset as usize..).and_then(|rest| rest.get(..bytes.len()));
        bytes.copy_from_slice(from.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        let sector = self.0.get_mut(from as usize..to as usize);
        sector.ok_or(NorFlashErrorKind::OutOfBounds)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let to = self.0.get_mut(offset as usize..offset as usize + bytes.len());
        to.ok_or(NorFlashErrorKind::OutOfBounds)?.copy_from_slice(bytes);
        Ok(())
    }
}

/// Loads the configuration from any contents, then stores another one and loads it.
pub fn run(input: &[u8]) {
    let mut flash = Flash([0xFF; 2 * SECTOR]);
    let length = input.len().min(flash.0.len());
    flash.0[..length].copy_from_slice(&input[..length]);
    let store = ConfigStore([0, SECTOR as u32]);
    let found = store.load(&mut flash);
    let example = Stored { wiring: Wiring::example(), config: Config::example() };
    let known = store.known_rig(&mut flash);
    let stored = store.save(&mut flash, &example, known.as_ref());
    assert_eq!(stored, Ok(()), "after {found:?}");
    assert_eq!(store.known_rig(&mut flash), known);
    assert_eq!(store.load(&mut flash), Some(example), "after {found:?}");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of the protocol makes the record one of another version, which is not loaded.
    #[test]
    fn the_record_in_the_corpus_is_of_this_version() {
        let mut flash = Flash([0xFF; 2 * SECTOR]);
        let record = include_bytes!("../../corpus/stored/one");
        flash.0[..record.len()].copy_from_slice(record);
        assert!(ConfigStore([0, SECTOR as u32]).load(&mut flash).is_some());
    }
}
