//! Pages of the book, as messages name them.

use std::path::Path;

/// Folder of the book on a computer with the Debian package.
const INSTALLED: &str = "/usr/share/doc/plumb/html";

/// Returns where a person finds the page `name` of the book's part "use": the installed page, or
/// else its source in the repository, below `docs/use`.
pub fn page(name: &str) -> String {
    page_in(Path::new(INSTALLED), name)
}

fn page_in(book: &Path, name: &str) -> String {
    let installed = book.join("use").join(name).with_extension("html");
    match installed.is_file() {
        true => installed.display().to_string(),
        false => format!("docs/use/{name}.md"),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_installed_page_is_named_where_there_is_one() {
        let book = tempfile::tempdir().unwrap();
        assert_eq!(page_in(book.path(), "board"), "docs/use/board.md");
        fs::create_dir(book.path().join("use")).unwrap();
        let page = book.path().join("use/board.html");
        fs::write(&page, "").unwrap();
        assert_eq!(page_in(book.path(), "board"), page.display().to_string());
        assert_eq!(page_in(book.path(), "opto"), "docs/use/opto.md");
    }
}
