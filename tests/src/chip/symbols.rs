//! Addresses of functions and variables in a firmware image.

use std::path::Path;

use object::{Object, ObjectSymbol};

/// Returns the address of the function or variable whose mangled name contains all `parts`.
///
/// # Panics
/// If the image cannot be read, or has no such symbol.
pub fn symbol_address(image: &Path, parts: &[&str]) -> u64 {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let found = file.symbols().find(|symbol| {
        let name = symbol.name().unwrap_or_default();
        // The names of the linker's jumps to it have a prefix.
        name.starts_with("_ZN") && parts.iter().all(|part| name.contains(part))
    });
    found.unwrap_or_else(|| panic!("no symbol with {parts:?} in {}", image.display())).address()
}
