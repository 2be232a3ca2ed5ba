//! Where functions are in the image.

use std::collections::BTreeMap;
use std::path::Path;

use object::{Object, ObjectSymbol, SymbolKind};

/// The address of the law's update: the trait's only implementor that is called through it, `Controller`.
pub(crate) fn law_update(image: &Path) -> u64 {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let found = file.symbols().find(|symbol| {
        symbol.name().is_ok_and(|name| {
            name.contains("plumb_core..law..Controller") && name.contains("Law") && name.contains("update")
        })
    });
    found.expect("the law's update, with a name and not inlined").address()
}

/// The functions of an image, by their addresses.
pub(crate) fn functions(image: &Path) -> BTreeMap<u64, (u64, String)> {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let functions = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0);
    let named = functions.filter_map(|f| Some((f.address() & !1, (f.size(), f.name().ok()?.to_owned()))));
    named.collect()
}
