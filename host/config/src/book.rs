//! Pages of the book, as messages name them.

use std::path::Path;

/// Folder of the book on a computer with the Debian package.
const INSTALLED: &str = "/usr/share/doc/plumb/html";

/// Returns where a person finds the book's first page: the installed one, or else its source in the
/// repository.
pub fn first_page() -> String {
    named(&Path::new(INSTALLED).join("index.html"), "docs/introduction.md")
}

/// Returns the path of an installed page, or else its `source` in the repository.
fn named(installed: &Path, source: &str) -> String {
    match installed.is_file() {
        true => installed.display().to_string(),
        false => source.to_owned(),
    }
}

/// Returns a text in which each page of the book's part "use" that it names by its source is named
/// as [`page`] does.
pub fn with_pages(text: &str) -> String {
    with_pages_in(Path::new(INSTALLED), text)
}

fn with_pages_in(book: &Path, text: &str) -> String {
    let mut parts = text.split("docs/use/");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once(".md") {
            Some((name, rest)) if name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') => {
                text.push_str(&page_in(book, name));
                text.push_str(rest);
            }
            _ => {
                text.push_str("docs/use/");
                text.push_str(part);
            }
        }
    }
    text
}

/// Returns where a person finds the page `name` of the book's part "use": the installed page, or
/// else its source in the repository, below `docs/use`.
pub fn page(name: &str) -> String {
    page_in(Path::new(INSTALLED), name)
}

fn page_in(book: &Path, name: &str) -> String {
    let installed = book.join("use").join(name).with_extension("html");
    named(&installed, &format!("docs/use/{name}.md"))
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
        let text = "docs/use/board.md and docs/use/opto.md, docs/use/70-plumb.rules";
        let named = format!("{} and docs/use/opto.md, docs/use/70-plumb.rules", page.display());
        assert_eq!(with_pages_in(book.path(), text), named);
    }
}
