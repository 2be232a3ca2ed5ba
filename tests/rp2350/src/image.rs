//! The firmware's image, as the emulator can run it.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol};
use plumb_image::Image;
use plumb_image::chip::RP2350;

/// Returns the path of the Pico 2's firmware: `PLUMB_PICO2_ELF`, or the result of
/// `make firmware BOARD=pico2`. Returns `None` if there is none.
///
/// # Panics
/// If there is no image and CI is set.
pub fn firmware_image() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let image = std::env::var_os("PLUMB_PICO2_ELF")
        .map_or_else(|| root.join("target/firmware/plumb-pico2.elf"), PathBuf::from);
    if image.exists() {
        return Some(image);
    }
    let hint = "make firmware BOARD=pico2";
    assert!(std::env::var_os("CI").is_none(), "{} is missing: {hint}", image.display());
    println!("skipped: {} is missing ({hint})", image.display());
    None
}

/// A firmware that the emulator can run.
#[derive(Debug, Clone)]
pub struct Firmware {
    /// Content of the flash, from its first address.
    pub flash: Vec<u8>,
    /// Number of instructions that were replaced: see `plain`.
    pub replaced: usize,
    /// Functions: name and address.
    functions: Vec<(String, u32)>,
}

impl Firmware {
    /// Reads a linked firmware, and replaces the instructions that the emulator lacks.
    ///
    /// # Errors
    /// If the file cannot be read, or is not a firmware of an RP2350.
    pub fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let elf = fs::read(path)?;
        let mut flash = Image::read(&elf, &RP2350)?.flash;
        let file = ElfFile32::<Endianness>::parse(&*elf)?;
        let mut replaced = 0;
        for [start, end] in code(&file) {
            if let Some(at) = load_offset(&file, start) {
                let length = (end - start) as usize;
                let code = flash.get_mut(at..at + length).ok_or("code outside the flash")?;
                replaced += replace(code);
            }
        }
        let functions = file.symbols().filter(|symbol| symbol.kind() == object::SymbolKind::Text);
        let functions = functions
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address() as u32)))
            .collect();
        Ok(Self { flash, replaced, functions })
    }

    /// Returns the address of the function whose mangled name contains all `parts`; `None` if there
    /// is none.
    pub fn function(&self, parts: &[&str]) -> Option<u32> {
        let has_all = |name: &str| parts.iter().all(|part| name.contains(part));
        let found = self.functions.iter().find(|(name, _)| has_all(name));
        found.map(|(_, address)| address & !1)
    }
}

/// Returns the places of instructions, begin and end, as the mapping symbols tell them: `$t` begins
/// instructions, `$d` data (ELF for the Arm Architecture, section 5.5.5).
fn code(file: &ElfFile32<'_, Endianness>) -> Vec<[u32; 2]> {
    let mut code = Vec::new();
    for section in file.sections() {
        let mut marks: Vec<(u32, bool)> = file
            .symbols()
            .filter(|symbol| symbol.section_index() == Some(section.index()))
            .filter_map(|symbol| match symbol.name().ok()?.get(..2)? {
                "$t" => Some((symbol.address() as u32, true)),
                "$d" => Some((symbol.address() as u32, false)),
                _ => None,
            })
            .collect();
        marks.push(((section.address() + section.size()) as u32, false));
        marks.sort_unstable();
        let spans = marks.windows(2).filter(|pair| pair[0].1);
        code.extend(spans.map(|pair| [pair[0].0, pair[1].0]));
    }
    code
}

/// Returns where the flash has the content of an address; `None` for one without content.
fn load_offset(file: &ElfFile32<'_, Endianness>, address: u32) -> Option<usize> {
    let endian = file.endian();
    let header = file.elf_header();
    let segments = header.program_headers(endian, file.data()).ok()?;
    let segment = segments.iter().find(|segment| {
        let first = segment.p_vaddr(endian);
        (first..first + segment.p_filesz(endian)).contains(&address)
    })?;
    let load = segment.p_paddr(endian) + (address - segment.p_vaddr(endian));
    Some(load.checked_sub(RP2350.flash.start)? as usize)
}

/// Replaces instructions in `code`, and returns how many.
fn replace(code: &mut [u8]) -> usize {
    let mut replaced = 0;
    let mut at = 0;
    while let Some(&[a, b]) = code.get(at..at + 2) {
        let first = u16::from_le_bytes([a, b]);
        // Instructions of four bytes (Armv8-M Architecture Reference Manual, C2.2).
        if first >> 11 < 0b11101 {
            at += 2;
            continue;
        }
        let Some(&[c, d]) = code.get(at + 2..at + 4) else { break };
        if let Some([first, second]) = plain(first, u16::from_le_bytes([c, d])) {
            code[at..at + 2].copy_from_slice(&first.to_le_bytes());
            code[at + 2..at + 4].copy_from_slice(&second.to_le_bytes());
            replaced += 1;
        }
        at += 4;
    }
    replaced
}

/// Returns the instruction that does the same as one that the emulator lacks; `None` for all others
/// (Armv8-M Architecture Reference Manual, C2.4):
/// - load-acquire and store-release (LDA, LDAEX, STL, STLEX and their narrow forms) become LDR,
///   LDREX, STR, STREX. On one processor without a cache of data they are the same;
/// - VSEL, VMAXNM and VMINNM: the emulator looks for the lowest bit of the destination in bit 4,
///   and for the condition in bits 5 and 6, where the processor has them in bit 6, and 4 and 5;
/// - VPUSH and VPOP of double registers become those of the single registers in the same places.
fn plain(first: u16, second: u16) -> Option<[u16; 2]> {
    let (base, value, status) = (first & 15, second & 0xf000, second & 15);
    match (first & 0xfff0, second & 0x0ff0) {
        (0xe8d0, 0xf80) => Some([0xf890 | base, value]),
        (0xe8d0, 0xf90) => Some([0xf8b0 | base, value]),
        (0xe8d0, 0xfa0) => Some([0xf8d0 | base, value]),
        (0xe8c0, 0xf80) => Some([0xf880 | base, value]),
        (0xe8c0, 0xf90) => Some([0xf8a0 | base, value]),
        (0xe8c0, 0xfa0) => Some([0xf8c0 | base, value]),
        (0xe8d0, 0xfe0) => Some([0xe850 | base, value | 0xf00]),
        (0xe8c0, 0xfe0) => Some([0xe840 | base, value | status << 8]),
        (0xe8d0 | 0xe8c0, 0xfc0 | 0xfd0) => Some([first, second & !0x80]),
        _ if matches!(first, 0xed2d | 0xecbd) && second & 0xf00 == 0xb00 => {
            Some([first, second & !0x100])
        }
        _ if first & 0xff00 == 0xfe00 && second & 0xf10 == 0xa00 => {
            let (destination, condition) = (first >> 6 & 1, first >> 4 & 3);
            let is_known = first & 0x80 == 0 || condition == 0;
            is_known.then_some([first & !0x70 | condition << 5 | destination << 4, second])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ldab r3, [r12]` and `stlex r2, r1, [r0]`, as LLVM encodes them, behind an instruction of
    /// two bytes; `tbb [pc, r3]` stays.
    #[test]
    fn acquire_and_release_become_plain() {
        let words = |halves: &[u16]| -> Vec<u8> {
            halves.iter().flat_map(|half| half.to_le_bytes()).collect()
        };
        let mut code = words(&[0x4293, 0xe8dc, 0x3f8f, 0xe8c0, 0x1fe2, 0xe8df, 0xf003]);
        assert_eq!(replace(&mut code), 2);
        let plain = [0x4293, 0xf89c, 0x3000, 0xe840, 0x1200, 0xe8df, 0xf003];
        assert_eq!(code, words(&plain));
    }

    /// `vmaxnm.f32 s15, s15, s26` and `vselgt.f32 s0, s1, s2`; `vpush {d8}` is that of s16 and s17.
    #[test]
    fn instructions_of_the_fpu_are_those_that_the_emulator_reads() {
        assert_eq!(plain(0xfec7, 0x7a8d), Some([0xfe97, 0x7a8d]));
        assert_eq!(plain(0xfe30, 0x0a81), Some([0xfe60, 0x0a81]));
        assert_eq!(plain(0xed2d, 0x8b02), Some([0xed2d, 0x8a02]));
        assert_eq!(plain(0xee70, 0x7a20), None);
    }
}
