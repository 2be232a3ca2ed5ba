//! What a linked firmware puts into the chip's flash and takes of its RAM.

use object::elf::{FileHeader32, PT_LOAD, SHF_ALLOC};
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader};
use object::{Endianness, Object, ObjectSymbol};
use thiserror::Error;

/// The chip's flash as the processor sees it.
pub const FLASH: std::ops::Range<u32> = 0x1000_0000..0x1020_0000;

/// The chip's RAM as the processor sees it.
pub const RAM: std::ops::Range<u32> = 0x2000_0000..0x2004_2000;

/// A linked firmware that cannot be turned into an image.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum ImageError {
    /// Not a 32-bit ELF file.
    #[error("not a linked firmware (32-bit ELF): {0}")]
    NotElf(#[from] object::Error),
    /// A part lies where the chip has no flash.
    #[error("{length} bytes at {address:#010x} are outside the flash: check firmware/memory.x")]
    OutsideFlash {
        /// Where it was to be put.
        address: u32,
        /// Its length.
        length: usize,
    },
    /// Nothing in it goes into the flash.
    #[error("there is nothing in it for the flash: was it linked with firmware/memory.x?")]
    Empty,
    /// A symbol of the linker script is missing.
    #[error("the symbol {0} is missing: was it linked with firmware/memory.x?")]
    NoSymbol(&'static str),
}

/// The flash's content and what the RAM is used for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// What goes into the flash from its first address on; gaps are filled with 0xff.
    pub flash: Vec<u8>,
    /// Bytes of RAM that variables and code take.
    pub statics: u32,
    /// Bytes of RAM that are kept for the stack.
    pub stack: u32,
}

impl Image {
    /// Reads a linked firmware.
    ///
    /// # Errors
    /// Where it is no 32-bit ELF file or was not linked for this chip.
    pub fn read(elf: &[u8]) -> Result<Self, ImageError> {
        let header = FileHeader32::<Endianness>::parse(elf)?;
        let endian = header.endian()?;
        let mut flash = Vec::new();
        for segment in header.program_headers(endian, elf)? {
            if segment.p_type(endian) == PT_LOAD {
                let bytes = segment.data(endian, elf).map_err(|()| ImageError::Empty)?;
                place(&mut flash, segment.p_paddr(endian), bytes)?;
            }
        }
        if flash.is_empty() {
            return Err(ImageError::Empty);
        }
        let statics = header
            .sections(endian, elf)?
            .iter()
            .filter(|s| s.sh_flags(endian) & SHF_ALLOC != 0 && RAM.contains(&s.sh_addr(endian)))
            .map(|s| s.sh_size(endian))
            .sum();
        let stack = symbol(elf, "_stack_start")?.saturating_sub(symbol(elf, "_stack_end")?);
        Ok(Self { flash, statics, stack })
    }
}

/// Puts `bytes` where the flash's `address` is.
fn place(flash: &mut Vec<u8>, address: u32, bytes: &[u8]) -> Result<(), ImageError> {
    if bytes.is_empty() {
        return Ok(());
    }
    let outside = ImageError::OutsideFlash { address, length: bytes.len() };
    let start = address.checked_sub(FLASH.start).ok_or(outside)? as usize;
    let end = start + bytes.len();
    if end > FLASH.len() {
        return Err(ImageError::OutsideFlash { address, length: bytes.len() });
    }
    if flash.len() < end {
        flash.resize(end, 0xff);
    }
    flash[start..end].copy_from_slice(bytes);
    Ok(())
}

fn symbol(elf: &[u8], name: &'static str) -> Result<u32, ImageError> {
    let file = object::File::parse(elf)?;
    let found = file.symbols().find(|s| s.name() == Ok(name)).map(|s| s.address() as u32);
    found.ok_or(ImageError::NoSymbol(name))
}
