//! The configuration in flash, with a loss of power at every moment of a write.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use crate::common::{config, wiring};
use crate::known_rig::known_rig;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use plumb_core::config_store::{ConfigStore, StoreError, Stored};

const SECTOR: usize = 4096;
const STORE: ConfigStore = ConfigStore([SECTOR as u32, 2 * SECTOR as u32]);

/// Flash of two sectors for the store and one before them. It changes byte by byte until the power
/// fails.
struct Flash {
    bytes: Vec<u8>,
    /// Bytes that change before the power fails.
    power: usize,
    writes: usize,
}

impl Flash {
    fn new() -> Self {
        Self { bytes: vec![0xff; 3 * SECTOR], power: usize::MAX, writes: 0 }
    }

    fn change(&mut self, at: usize, to: u8) -> Result<(), NorFlashErrorKind> {
        self.power = self.power.checked_sub(1).ok_or(NorFlashErrorKind::Other)?;
        self.bytes[at] = to;
        self.writes += 1;
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        assert!(
            (from as usize).is_multiple_of(SECTOR)
                && (to - from) as usize == SECTOR
                && from as usize >= SECTOR
        );
        (from as usize..to as usize).try_for_each(|at| self.change(at, 0xff))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        // A write only clears bits.
        bytes
            .iter()
            .zip(offset as usize..)
            .try_for_each(|(&b, at)| self.change(at, self.bytes[at] & b))
    }
}

fn numbered(number: u8) -> Stored {
    let (mut config, mut wiring) = (config(), wiring());
    config.reached.frames = number;
    wiring.pins.emergency.number = number;
    Stored { wiring, config }
}

#[test]
fn the_last_configuration_is_loaded() {
    let mut flash = Flash::new();
    assert_eq!(STORE.load(&mut flash), None);
    for number in 1..20 {
        assert_eq!(STORE.save(&mut flash, &numbered(number), None), Ok(()));
        assert_eq!(STORE.load(&mut flash), Some(numbered(number)));
    }
    assert!(
        flash.bytes[..SECTOR].iter().all(|&b| b == 0xff),
        "the sector before the store is unchanged"
    );
}

#[test]
fn an_unchanged_configuration_is_not_written_again() {
    let mut flash = Flash::new();
    STORE.save(&mut flash, &numbered(1), None).unwrap();
    let writes = flash.writes;
    STORE.save(&mut flash, &numbered(1), None).unwrap();
    assert_eq!(flash.writes, writes);
}

#[test]
fn a_loss_of_power_leaves_the_old_configuration_or_the_new_one() {
    let mut before = Flash::new();
    STORE.save(&mut before, &numbered(1), None).unwrap();
    STORE.save(&mut before, &numbered(2), None).unwrap();
    let mut news = 0;
    // A sector is erased and two pages written; around the record's end every byte counts.
    for power in (0..SECTOR).step_by(61).chain(SECTOR..SECTOR + 512) {
        let mut flash = Flash { bytes: before.bytes.clone(), power, writes: 0 };
        assert_eq!(STORE.save(&mut flash, &numbered(3), None), Err(StoreError));
        flash.power = usize::MAX;
        let found = STORE.load(&mut flash).unwrap();
        assert!(
            found == numbered(2) || found == numbered(3),
            "after {power} bytes: {}",
            found.config.reached.frames
        );
        news += usize::from(found == numbered(3));
        // The store works on after it.
        STORE.save(&mut flash, &numbered(4), None).unwrap();
        assert_eq!(STORE.load(&mut flash), Some(numbered(4)));
    }
    assert!(news > 0, "the new one is valid once it is whole");
}

#[test]
fn the_known_rig_is_stored_with_the_configuration() {
    let (mut flash, known) = (Flash::new(), known_rig());
    STORE.save(&mut flash, &numbered(1), None).unwrap();
    assert_eq!(STORE.known_rig(&mut flash), None);
    STORE.save(&mut flash, &numbered(1), Some(&known)).unwrap();
    assert_eq!(STORE.load(&mut flash), Some(numbered(1)));
    assert_eq!(STORE.known_rig(&mut flash).as_ref(), Some(&known));
    let writes = flash.writes;
    STORE.save(&mut flash, &numbered(1), Some(&known)).unwrap();
    STORE.save(&mut flash, &numbered(1), None).unwrap();
    assert_eq!(flash.writes, writes, "nothing new");
    STORE.save(&mut flash, &numbered(2), None).unwrap();
    assert_eq!(STORE.known_rig(&mut flash), None, "it was of another configuration");
}

#[test]
fn a_loss_of_power_never_gives_a_rig_of_another_record() {
    let (mut before, known) = (Flash::new(), known_rig());
    STORE.save(&mut before, &numbered(1), Some(&known)).unwrap();
    for power in (0..SECTOR).step_by(61).chain(SECTOR..SECTOR + 768) {
        let mut flash = Flash { bytes: before.bytes.clone(), power, writes: 0 };
        let result = STORE.save(&mut flash, &numbered(2), Some(&known));
        flash.power = usize::MAX;
        let found = STORE.load(&mut flash).unwrap();
        assert_eq!(found, numbered(if result.is_ok() { 2 } else { found.config.reached.frames }));
        assert_eq!(STORE.known_rig(&mut flash).as_ref(), Some(&known), "after {power} bytes");
    }
}

#[test]
fn a_damaged_rig_is_not_loaded() {
    let (mut flash, known) = (Flash::new(), known_rig());
    STORE.save(&mut flash, &numbered(1), Some(&known)).unwrap();
    for at in SECTOR + 512..SECTOR + 700 {
        let mut flash = Flash { bytes: flash.bytes.clone(), ..Flash::new() };
        flash.bytes[at] ^= 0x10;
        assert_eq!(STORE.load(&mut flash), Some(numbered(1)));
        assert_eq!(STORE.known_rig(&mut flash), None, "byte {at}");
    }
}

#[test]
fn a_damaged_record_is_not_loaded() {
    let mut flash = Flash::new();
    STORE.save(&mut flash, &numbered(1), None).unwrap();
    STORE.save(&mut flash, &numbered(2), None).unwrap();
    let damaged = 2 * SECTOR;
    for at in (damaged..damaged + 100).chain(damaged + 256..damaged + 290) {
        let mut flash = Flash { bytes: flash.bytes.clone(), ..Flash::new() };
        flash.bytes[at] ^= 0x10;
        assert_eq!(STORE.load(&mut flash), Some(numbered(1)), "byte {at}");
    }
}
