//! Where functions are in the image.

use std::path::Path;

use object::{Object, ObjectSymbol};

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
