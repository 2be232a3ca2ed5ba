//! Changes values in the text of a TOML file, and leaves the rest as it is.

use toml_edit::{DocumentMut, Item, TableLike, Value};

pub use toml_edit::TomlError;

/// Text of a TOML file whose values are changed.
#[derive(Debug)]
pub struct TomlText {
    document: DocumentMut,
    /// Whether its lines end as on Windows. `toml_edit` writes those of Unix.
    has_windows_ends: bool,
}

/// Table whose values are changed.
pub struct TextTable<'a> {
    table: &'a mut dyn TableLike,
    /// Comment behind a value that is replaced, in place of the old one.
    comment: Option<&'a str>,
}

impl TomlText {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// Where it is no TOML.
    pub fn parse(text: &str) -> Result<Self, TomlError> {
        Ok(Self { document: text.parse()?, has_windows_ends: text.contains("\r\n") })
    }

    /// Returns the table `name`; `None` where there is none. `comment` replaces the comment behind
    /// each value that is replaced, except in an inline table, whose values share a line. Without
    /// it the old comments stay.
    pub fn table<'a>(&'a mut self, name: &str, comment: Option<&'a str>) -> Option<TextTable<'a>> {
        let item = self.document.get_mut(name)?;
        let comment = comment.filter(|_| !item.is_inline_table());
        Some(TextTable { table: item.as_table_like_mut()?, comment })
    }

    /// Returns the new text.
    pub fn text(&self) -> String {
        let text = self.document.to_string();
        if self.has_windows_ends { text.replace('\n', "\r\n") } else { text }
    }
}

impl TextTable<'_> {
    /// Replaces the value of `key` by `text`, which is a value of TOML. Returns `None` where the
    /// table has no such key.
    pub fn replace(&mut self, key: &str, text: &str) -> Option<()> {
        let old = self.table.get_mut(key)?.as_value_mut()?;
        let mut new: Value = text.parse().ok()?;
        *new.decor_mut() = old.decor().clone();
        if let Some(comment) = self.comment {
            new.decor_mut().set_suffix(format!("  # {comment}"));
        }
        *old = new;
        Some(())
    }

    /// Sets the value of `key`, which is added at the end of a table without it.
    pub fn set(&mut self, key: &str, text: &str) {
        if self.replace(key, text).is_none()
            && let Ok(value) = text.parse::<Value>()
        {
            self.table.insert(key, Item::Value(value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `text` with the value 2 for the key `b` of the table `a`.
    fn changed(text: &str, comment: Option<&str>) -> String {
        let mut file = TomlText::parse(text).unwrap();
        file.table("a", comment).unwrap().set("b", "2");
        file.text()
    }

    #[test]
    fn only_the_value_and_its_comment_change() {
        let text = "# first\n[a] # mine\nb = [1,\n 3] # old\n# last\n";
        assert_eq!(changed(text, None), "# first\n[a] # mine\nb = 2 # old\n# last\n");
        assert_eq!(changed(text, Some("new")), "# first\n[a] # mine\nb = 2  # new\n# last\n");
        assert_eq!(changed("a = { b = 1 } # c\n", Some("new")), "a = { b = 2 } # c\n");
        assert_eq!(changed("[a]\r\nb = 1\r\n# c\r\n", None), "[a]\r\nb = 2\r\n# c\r\n");
    }

    #[test]
    fn a_missing_key_is_added_and_a_missing_table_is_none() {
        assert_eq!(changed("[a]\nc = 1\n[d]\n", None), "[a]\nc = 1\nb = 2\n[d]\n");
        assert_eq!(changed("a = { c = 1 }\n", None), "a = { c = 1 , b = 2 }\n");
        assert!(TomlText::parse("[a]\n").unwrap().table("b", None).is_none());
        assert!(TomlText::parse("[a\n").is_err());
    }
}
