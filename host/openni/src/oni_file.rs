//! The skeleton of an `.oni` file, looked at before the library is given it: the library reads a damaged one past its
//! own memory, and says of a truncated one only that it failed.
//!
//! A file is a header of 24 bytes and records, all little-endian: magic `NIR\0`, type, node, bytes of header and fields, bytes
//! of payload (32 bits each), position of an undo record (64 bits); then fields and payload.

use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use thiserror::Error;

const FILE_MAGIC: &[u8; 4] = b"NI10";
const FILE_HEADER: u64 = 24;
const RECORD_MAGIC: &[u8; 4] = b"NIR\0";
const RECORD_HEADER: u64 = 28;
/// No fields are so long: names and properties.
const LONGEST_FIELDS: u64 = 1 << 16;
/// Record types that are known, 1 to this.
const LAST_TYPE: u32 = 18;
const NEW_DATA: u32 = 10;
const END: u32 = 11;

/// What a file's records say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Skeleton {
    /// Pictures of all its streams.
    pub(crate) pictures: u32,
    /// Bytes to the end of the last record; recorders leave what they like behind it.
    pub(crate) length: u64,
}

/// Why it is no recording that can be played.
#[derive(Debug, Error)]
pub(crate) enum SkeletonError {
    #[error("{0}")]
    Io(#[from] io::Error),
    #[error("it is no .oni recording (its first bytes are not NI10)")]
    Magic,
    #[error(
        "damaged or truncated: it ends after {pictures} pictures, at byte {at}, without the record that closes it"
    )]
    Truncated { pictures: u32, at: u64 },
    #[error("damaged: at byte {at}, after {pictures} pictures, there is no record")]
    Damaged { pictures: u32, at: u64 },
}

/// Looks through the records of the file at `path`.
///
/// # Errors
/// Where it cannot be read, or is not whole.
pub(crate) fn examine(path: &Path) -> Result<Skeleton, SkeletonError> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut file = BufReader::with_capacity(256, file);
    let mut magic = [0; 4];
    if !read(&mut file, &mut magic)? || &magic != FILE_MAGIC {
        return Err(SkeletonError::Magic);
    }
    let (mut at, mut pictures) = (FILE_HEADER, 0);
    loop {
        file.seek(SeekFrom::Start(at))?;
        let mut header = [0; RECORD_HEADER as usize];
        if !read(&mut file, &mut header)? {
            return Err(SkeletonError::Truncated { pictures, at });
        }
        let (words, _) = header.as_chunks::<4>();
        let number = |word: usize| words.get(word).map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let (kind, fields, payload) = (number(1), u64::from(number(3)), u64::from(number(4)));
        let known = words.first() == Some(RECORD_MAGIC) && (1..=LAST_TYPE).contains(&kind);
        if !known || !(RECORD_HEADER..=LONGEST_FIELDS).contains(&fields) {
            return Err(SkeletonError::Damaged { pictures, at });
        }
        let next = at + fields + payload;
        if next > length {
            return Err(SkeletonError::Truncated { pictures, at });
        }
        pictures += u32::from(kind == NEW_DATA);
        at = next;
        if kind == END {
            return Ok(Skeleton { pictures, length: at });
        }
    }
}

/// Cuts off what is behind the last record.
///
/// # Errors
/// Where the file is not whole or cannot be written.
pub(crate) fn trim(path: &Path) -> Result<Skeleton, SkeletonError> {
    let skeleton = examine(path)?;
    OpenOptions::new().write(true).open(path)?.set_len(skeleton.length)?;
    Ok(skeleton)
}

/// Fills `bytes`; `false` at the file's end.
fn read(file: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(kind: u32, payload: u32) -> Vec<u8> {
        let mut bytes = RECORD_MAGIC.to_vec();
        for word in [kind, 1, 28, payload, 0, 0] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.resize(28 + payload as usize, 7);
        bytes
    }

    /// A recording of two pictures.
    fn whole() -> Vec<u8> {
        let mut bytes = FILE_MAGIC.to_vec();
        bytes.resize(FILE_HEADER as usize, 0);
        for (kind, payload) in [(13, 0), (NEW_DATA, 50), (NEW_DATA, 40), (END, 0)] {
            bytes.extend(record(kind, payload));
        }
        bytes
    }

    fn of(bytes: &[u8]) -> Result<Skeleton, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.oni");
        std::fs::write(&path, bytes).unwrap();
        let found = examine(&path).map_err(|error| error.to_string());
        if let Ok(skeleton) = &found {
            trim(&path).unwrap();
            assert_eq!(std::fs::metadata(&path).unwrap().len(), skeleton.length);
        }
        found
    }

    #[test]
    fn a_whole_file_is_counted_and_trimmed() {
        let mut bytes = whole();
        let length = bytes.len() as u64;
        assert_eq!(of(&bytes), Ok(Skeleton { pictures: 2, length }));
        bytes.extend([1; 1000]);
        assert_eq!(of(&bytes), Ok(Skeleton { pictures: 2, length }));
    }

    #[test]
    fn wherever_it_is_cut_it_is_told() {
        let bytes = whole();
        for length in 0..bytes.len() {
            let error = of(&bytes[..length]).unwrap_err();
            let says = if length < 4 { "NI10" } else { "truncated" };
            assert!(error.contains(says), "{length}: {error}");
        }
    }

    #[test]
    fn a_record_that_is_none_is_told_with_its_place() {
        for (at, value) in [(24, 0), (28, 99), (28, 0), (36, 1), (36 + 3, 255)] {
            let mut bytes = whole();
            bytes[at] = value;
            assert!(of(&bytes).unwrap_err().contains("damaged: at byte 24"), "{at}");
        }
    }
}
