//! Flash content and RAM use of a linked firmware.

use std::ops::Range;

use object::elf::{FileHeader32, PT_LOAD, SHF_ALLOC};
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader};
use object::{Endianness, Object, ObjectSymbol};
use thiserror::Error;

use crate::chip::Chip;

/// Sizes of a firmware, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Content of the flash.
    pub flash: u32,
    /// RAM for variables and for code.
    pub ram: u32,
}

/// Reason why a linked firmware cannot be converted to an image.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum ImageError {
    /// Not a 32-bit ELF file.
    #[error("not a linked firmware (32-bit ELF)")]
    NotElf(#[from] object::Error),
    /// A segment is outside the chip's flash.
    #[error("{length} bytes at {address:#010x} are outside the flash: check firmware/memory-*.x")]
    OutsideFlash {
        /// Address of the segment.
        address: u32,
        /// Length of the segment, bytes.
        length: usize,
    },
    /// The file has no content for the flash.
    #[error("the file has no content for the flash: was it linked with firmware/build.rs?")]
    Empty,
    /// A symbol of the linker script is missing.
    #[error("the symbol {0} is missing: was it linked with firmware/build.rs?")]
    NoSymbol(&'static str),
}

/// Flash content and RAM use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Content of the flash from its first address; gaps are filled with 0xff.
    pub flash: Vec<u8>,
    /// RAM for variables and code, bytes.
    pub statics: u32,
    /// RAM for the stack, bytes.
    pub stack: u32,
    /// Most that the linker places in flash and in RAM besides the stack.
    pub room: Sizes,
}

impl Image {
    /// Reads a firmware that was linked for `chip`.
    ///
    /// # Errors
    /// If the file is not a 32-bit ELF file or was not linked for this chip.
    pub fn read(elf: &[u8], chip: &Chip) -> Result<Self, ImageError> {
        let header = FileHeader32::<Endianness>::parse(elf)?;
        let endian = header.endian()?;
        let mut flash = Vec::new();
        for segment in header.program_headers(endian, elf)? {
            if segment.p_type(endian) == PT_LOAD {
                let bytes = segment.data(endian, elf).map_err(|()| ImageError::Empty)?;
                place(&mut flash, &chip.flash, segment.p_paddr(endian), bytes)?;
            }
        }
        if flash.is_empty() {
            return Err(ImageError::Empty);
        }
        let statics = header
            .sections(endian, elf)?
            .iter()
            .filter(|s| {
                s.sh_flags(endian) & SHF_ALLOC != 0 && chip.ram.contains(&s.sh_addr(endian))
            })
            .map(|s| s.sh_size(endian))
            .sum();
        // The variables begin where the stack does, which grows away from them.
        let begin = symbol(elf, "_stack_start")?;
        let stack = begin.saturating_sub(symbol(elf, "_stack_end")?);
        let room = Sizes {
            flash: symbol(elf, "_flash_end")?.saturating_sub(chip.flash.start),
            ram: symbol(elf, "_ram_end")?.saturating_sub(begin),
        };
        Ok(Self { flash, statics, stack, room })
    }

    /// Returns the use of flash and RAM.
    pub fn used(&self) -> Sizes {
        Sizes { flash: self.flash.len() as u32, ram: self.statics }
    }
}

/// Writes `bytes` to the place of `address` in `flash`, which has the addresses `all` and grows as
/// needed.
fn place(
    flash: &mut Vec<u8>,
    all: &Range<u32>,
    address: u32,
    bytes: &[u8],
) -> Result<(), ImageError> {
    if bytes.is_empty() {
        return Ok(());
    }
    let outside = ImageError::OutsideFlash { address, length: bytes.len() };
    let start = address.checked_sub(all.start).ok_or(outside)? as usize;
    let end = start + bytes.len();
    if end > all.len() {
        return Err(ImageError::OutsideFlash { address, length: bytes.len() });
    }
    if flash.len() < end {
        flash.resize(end, 0xff);
    }
    flash[start..end].copy_from_slice(bytes);
    Ok(())
}

/// Returns the address of a symbol.
fn symbol(elf: &[u8], name: &'static str) -> Result<u32, ImageError> {
    let file = object::File::parse(elf)?;
    let found = file.symbols().find(|s| s.name() == Ok(name)).map(|s| s.address() as u32);
    found.ok_or(ImageError::NoSymbol(name))
}
