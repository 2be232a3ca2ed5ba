//! Addresses of functions in the image.

use std::collections::BTreeMap;
use std::path::Path;

use object::{Object, ObjectSymbol, SymbolKind};
use plumb_tests::chip::symbol_address;

/// Returns the address of the law's update: in the tick for inline laws, in the law worker for
/// deferred laws.
pub(crate) fn law_update(image: &Path, deferred: bool) -> u64 {
    let parts: &[&str] = match deferred {
        true => &["plumb_core", "law_worker", "LawWorker", "respond"],
        false => &["plumb_core..law..selection..InlineLaw", "Law", "update"],
    };
    symbol_address(image, parts)
}

/// Returns size and name of each function of an image, by address.
pub(crate) fn functions(image: &Path) -> BTreeMap<u64, (u64, String)> {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let functions =
        file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0);
    let named =
        functions.filter_map(|f| Some((f.address() & !1, (f.size(), f.name().ok()?.to_owned()))));
    named.collect()
}
