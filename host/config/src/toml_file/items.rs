//! Mistakes of the items of a list, each by its number.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::one_line;
use crate::type_words::in_words;

/// Item of a list that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrongItem {
    /// Its number in the list, from 1.
    pub number: usize,
    /// Text of the item in the list.
    pub value: String,
    /// Description.
    pub message: String,
}

/// Returns the items of `list`, the text of a TOML value, that are no `T`; none where it is no
/// list.
///
/// ```
/// let wrong = plumb_config::toml_file::wrong_items::<u8>("[1, 'a', 3]");
/// assert_eq!((wrong[0].number, wrong[0].value.as_str()), (2, "'a'"));
/// ```
pub fn wrong_items<T: DeserializeOwned>(list: &str) -> Vec<WrongItem> {
    let text = format!("list = {list}");
    let (table, _) = DeTable::parse_recoverable(&text);
    let items = match table.get_ref().get("list").map(|list| list.get_ref()) {
        Some(DeValue::Array(items)) => items.iter(),
        _ => [].iter(),
    };
    let written = items.map(|item| text.get(item.span()).unwrap_or_default());
    let wrong = |(number, value): (usize, &str)| {
        let message = mistake::<T>(value)?;
        Some(WrongItem { number, value: value.to_owned(), message })
    };
    (1..).zip(written).filter_map(wrong).collect()
}

/// Returns what is wrong with `value`, the text of a TOML value, as a `T`.
fn mistake<T: DeserializeOwned>(value: &str) -> Option<String> {
    #[derive(Deserialize)]
    struct File<T> {
        #[serde(rename = "item")]
        _item: T,
    }

    let error = toml::from_str::<File<T>>(&format!("item = {value}")).err()?;
    Some(in_words(&one_line(error.message())))
}
