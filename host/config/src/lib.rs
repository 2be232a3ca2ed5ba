//! Files that a person writes or names, and the errors about them.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod bounded_read;
pub mod error_chain;
pub mod quantity;
pub mod reference;
pub mod toml_file;
pub mod whole_writes;
