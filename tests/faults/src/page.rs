//! The campaign's page of the book, and the tables in it.

use std::fs;
use std::io;
use std::path::Path;

/// Path of the page.
const PAGE: &str = "../../docs/understand/campaign.md";

/// Replaces the table `name` of the page: the text between the lines `<!-- table NAME -->` and
/// `<!-- end -->`.
///
/// # Errors
/// Where the page cannot be read or written, or has no such table.
pub fn replace_table(name: &str, table: &str) -> io::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let text = fs::read_to_string(&path)?;
    let replaced = with_table(&text, name, table);
    let missing = || io::Error::other(format!("{}: no table {name}", path.display()));
    fs::write(&path, replaced.ok_or_else(missing)?)
}

/// Returns `text` with another table `name`; `None` if it has no such table.
fn with_table(text: &str, name: &str, table: &str) -> Option<String> {
    let (head, rest) = text.split_once(&format!("<!-- table {name} -->\n"))?;
    let (_, tail) = rest.split_once("<!-- end -->")?;
    Some(format!("{head}<!-- table {name} -->\n\n{}\n\n<!-- end -->{tail}", table.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_table_is_replaced_and_nothing_else() {
        let text = "a\n<!-- table x -->\nold\n<!-- end -->\nb\n<!-- table y -->\n<!-- end -->\n";
        let new = with_table(text, "x", "new\n").expect("a table");
        let expected =
            "a\n<!-- table x -->\n\nnew\n\n<!-- end -->\nb\n<!-- table y -->\n<!-- end -->\n";
        assert_eq!(new, expected);
        assert_eq!(with_table(text, "z", ""), None);
    }
}
