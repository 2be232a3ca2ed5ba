//! Files that a person writes or names, and the errors about them.
//!
//! - [`mistake`]: a mistake with its line, key and value; [`toml_file`]: configuration files;
//!   [`toml_text`]: change of values in their text.
//! - [`quantity`]: numbers with a range and a unit; [`any_case`](mod@any_case): names in any case;
//!   [`reference`](mod@reference): the keys of a file, from its reference page in the book.
//! - [`bounded_read`]: reading of regular files up to a limit; [`whole_writes`]: files whose
//!   records are whole, also where the disk is full.
//! - [`book`]: pages of the book in messages.
//! - [`error_chain`]: the message of an error with its causes; [`escape`]: texts of others without
//!   control characters.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod any_case;
pub mod book;
pub mod bounded_read;
pub mod error_chain;
pub mod escape;
pub mod mistake;
pub mod quantity;
pub mod reference;
pub mod toml_file;
pub mod toml_text;
pub mod whole_writes;
