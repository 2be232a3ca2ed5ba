//! Functions that a function of the firmware can reach, by its machine code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol, SectionIndex, SymbolKind};

/// A function of the firmware.
struct Function<'a> {
    name: &'a str,
    section: SectionIndex,
    size: u64,
}

/// A firmware's functions and their code.
struct Code<'a> {
    file: object::File<'a>,
    functions: BTreeMap<u64, Function<'a>>,
    /// Where code and data begin in the sections of code, by the ELF's mapping symbols.
    is_code: BTreeMap<u64, bool>,
}

/// Returns the functions in flash that `root` reaches, each with its callers.
///
/// Functions in the section `.cold` run at the start or at standstill only, or panic; they are not
/// followed. Functions whose mangled name begins with one of `indirect` count as reached too: those
/// that are called through pointers in a table.
///
/// # Panics
/// If the file is no ELF file with the function `root` and its symbols.
pub fn reached_in_flash(elf: &Path, root: &str, indirect: &[&str]) -> Vec<String> {
    let bytes = fs::read(elf).expect("the firmware");
    let code = Code::read(&bytes);
    let cold = code.file.section_by_name(".cold").expect("the section .cold").index();
    let is_root = |name: &str| name == root || indirect.iter().any(|part| name.starts_with(part));
    let roots: Vec<u64> = code
        .functions
        .iter()
        .filter_map(|(&at, function)| is_root(function.name).then_some(at))
        .collect();
    assert!(roots.len() > indirect.len(), "{root} and {indirect:?} are functions");
    let mut callers: BTreeMap<u64, Option<u64>> = roots.iter().map(|&at| (at, None)).collect();
    let mut left = roots;
    while let Some(at) = left.pop() {
        for called in code.called_by(at) {
            if code.functions[&called].section != cold && !callers.contains_key(&called) {
                callers.insert(called, Some(at));
                left.push(called);
            }
        }
    }
    let flash = 0x1000_0000..0x2000_0000;
    callers.keys().filter(|at| flash.contains(*at)).map(|&at| code.path(at, &callers)).collect()
}

impl<'a> Code<'a> {
    fn read(bytes: &'a [u8]) -> Self {
        let file = object::File::parse(bytes).expect("an ELF file");
        let (mut functions, mut is_code) = (BTreeMap::new(), BTreeMap::new());
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            match name.split('.').next() {
                Some("$t") => drop(is_code.insert(symbol.address(), true)),
                Some("$d") => drop(is_code.insert(symbol.address(), false)),
                _ => {}
            }
            if symbol.kind() == SymbolKind::Text
                && symbol.size() > 0
                && let Some(section) = symbol.section_index()
            {
                let (address, size) = (symbol.address() & !1, symbol.size());
                functions.insert(address, Function { name, section, size });
            }
        }
        Self { file, functions, is_code }
    }

    /// Returns the function that contains an address.
    fn function_at(&self, address: u64) -> Option<u64> {
        let (&at, function) = self.functions.range(..=address).next_back()?;
        (address < at + function.size).then_some(at)
    }

    /// Returns the functions that the one at `start` calls, jumps to, or has the addresses of.
    fn called_by(&self, start: u64) -> BTreeSet<u64> {
        let size = self.functions[&start].size;
        let code = self.bytes(start, size);
        let half = |at: u64| {
            let at = at as usize;
            code.get(at..at + 2).map_or(0, |half| u16::from_le_bytes([half[0], half[1]]))
        };
        let mut called = BTreeSet::new();
        let mut at = 0;
        while at < size {
            let here = start + at;
            let (first, second) = (half(at), half(at + 2));
            let wide = first >> 11 > 0b11100;
            if self.is_code.range(..=here).next_back().is_none_or(|(_, code)| *code) {
                let target = match first >> 11 {
                    _ if wide => branch_with_link(here, first, second),
                    0b01001 => self.literal(here, first),
                    0b11100 => Some(offset(here, u64::from(first) << 1, 12)),
                    _ if first >> 12 == 0b1101 => Some(offset(here, u64::from(first) << 1, 9)),
                    _ => None,
                };
                called.extend(target.and_then(|target| self.function_at(target & !1)));
            }
            at += if wide { 4 } else { 2 };
        }
        called.remove(&start);
        called
    }

    /// Returns the word that `ldr rN, [pc, #...]` loads, if it is the address of a function.
    fn literal(&self, here: u64, instruction: u16) -> Option<u64> {
        let at = ((here + 4) & !3) + 4 * u64::from(instruction & 0xff);
        let word = self.bytes(at, 4);
        let word = u64::from(u32::from_le_bytes(word.try_into().ok()?));
        (word & 1 == 1 && self.functions.contains_key(&(word & !1))).then_some(word)
    }

    fn bytes(&self, address: u64, size: u64) -> Vec<u8> {
        let found = self.file.sections().find_map(|section| {
            section.data_range(address, size).ok().flatten().map(<[u8]>::to_vec)
        });
        found.unwrap_or_default()
    }

    /// Returns the name of a function and of its callers, up to the root.
    fn path(&self, at: u64, callers: &BTreeMap<u64, Option<u64>>) -> String {
        let mut names = vec![format!("{at:#x} {}", self.functions[&at].name)];
        let mut next = callers[&at];
        while let Some(caller) = next {
            names.push(self.functions[&caller].name.to_owned());
            next = callers[&caller];
        }
        names.join(" <- ")
    }
}

/// Returns the target of `bl` (ARMv6-M Architecture Reference Manual, A6.7.13); `None` for another
/// instruction of 32 bits.
fn branch_with_link(here: u64, first: u16, second: u16) -> Option<u64> {
    if first >> 11 != 0b11110 || second >> 14 != 0b11 || second & 1 << 12 == 0 {
        return None;
    }
    let [sign, high] = [u64::from(first >> 10 & 1), u64::from(first & 0x3ff)];
    let bit = |n: u16| u64::from(second >> n & 1) ^ sign ^ 1;
    let low = u64::from(second & 0x7ff);
    let value = sign << 24 | bit(13) << 23 | bit(11) << 22 | high << 12 | low << 1;
    Some(offset(here, value, 25))
}

/// Returns the address that a branch at `here` leads to: its offset has `bits` bits and a sign.
fn offset(here: u64, value: u64, bits: u32) -> u64 {
    let signed = (value << (64 - bits)) as i64 >> (64 - bits);
    (here + 4).wrapping_add_signed(signed)
}
