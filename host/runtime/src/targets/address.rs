//! Address of a stream of targets.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use plumb_cameras::stream::{AddressError, StreamAddress};
use thiserror::Error;

/// Place that a stream of targets comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TargetAddress {
    /// A program that sends them: `-`, `unix:PATH` or `tcp:127.0.0.1:PORT`.
    Program(StreamAddress),
    /// A file that is read as fast as its time stamps say.
    File(PathBuf),
}

/// Text that is no address of a stream of targets.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TargetAddressError {
    /// There is no such file, and the text has none of the forms of an address.
    #[error(
        "there is no file {0:?}; from a program, targets come through unix:PATH, \
         tcp:127.0.0.1:PORT, or - (standard input)"
    )]
    NoFile(String),
    /// The address of a program is not possible.
    #[error(transparent)]
    Program(AddressError),
}

impl FromStr for TargetAddress {
    type Err = TargetAddressError;

    fn from_str(text: &str) -> Result<Self, TargetAddressError> {
        match text.parse() {
            Ok(address) => Ok(Self::Program(address)),
            Err(AddressError::Form(_)) if Path::new(text).exists() => Ok(Self::File(text.into())),
            Err(AddressError::Form(_)) => Err(TargetAddressError::NoFile(text.to_owned())),
            Err(error) => Err(TargetAddressError::Program(error)),
        }
    }
}

impl fmt::Display for TargetAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Program(address) => address.fmt(f),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_config::error_chain::ErrorChain;

    #[test]
    fn a_file_or_a_program_is_read_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("targets.jsonl");
        std::fs::write(&file, "").unwrap();
        for text in ["-", "unix:targets.sock", "tcp:127.0.0.1:5601", file.to_str().unwrap()] {
            assert_eq!(text.parse::<TargetAddress>().unwrap().to_string(), text);
        }
        for (text, named) in [
            ("none.jsonl", "there is no file \"none.jsonl\""),
            ("tcp:0.0.0.0:5601", "can be reached from other computers"),
        ] {
            let error = text.parse::<TargetAddress>().unwrap_err();
            let message = ErrorChain(&error).to_string();
            assert!(message.contains(named), "{message}");
        }
    }
}
