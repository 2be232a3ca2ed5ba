//! Check of an `.oni` file before the library opens it. The library's player reads a damaged file
//! beyond its own memory, and reports no reason for a truncated one.
//!
//! A file is a header of 24 bytes and records, all little-endian. A record is a header, fields and
//! a payload; the header has the magic `NIR\0`, the type, the node (stream), the bytes of header
//! and fields, the bytes of the payload (32 bits each) and the position of an undo record (64
//! bits).
//!
//! Strings in fields are a length (32 bits, with the final zero) and characters. A record that adds
//! a stream has name, type, codec, number of pictures, first and last time stamp, and the position
//! of its index; a property has name, length and value; a picture has time stamp and number. The
//! index has an entry for each picture, after an empty one: time stamp, an unused number, position.

mod node;
mod record;
mod streams;
#[cfg(test)]
mod tests;

use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use thiserror::Error;

use record::{END, INDEX, RECORD_HEADER, Record};
use streams::Streams;

/// First bytes of a file.
const FILE_MAGIC: &[u8; 4] = b"NI10";
/// Bytes of the file's header.
const FILE_HEADER: u64 = 24;
/// Most records of a file: colour and depth at 30 Hz for a day.
const MAX_RECORDS: usize = 6_000_000;
/// Most bytes of an index: an entry of 20 bytes for each record.
const MAX_INDEX: u64 = 20 * MAX_RECORDS as u64;
/// Bytes read at a time: headers and fields are short, and pictures are skipped.
const BUFFER: usize = 256;

/// Summary of a complete file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OniSummary {
    /// Pictures of all streams.
    pub(crate) pictures: u32,
    /// Bytes to the end of the last record. Recorders leave unused bytes behind it.
    pub(crate) length: u64,
}

/// Reason why a file is no recording that can be played.
#[derive(Debug, Error)]
pub(crate) enum OniFileError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("it is no regular file")]
    NotAFile,
    #[error("it has more than {0} records: split the recording")]
    TooManyRecords(usize),
    #[error("it is no .oni recording (its first bytes are not NI10)")]
    Magic,
    #[error(
        "damaged or truncated: it ends after {pictures} pictures, at byte {at}, without the record \
         that closes it"
    )]
    Truncated { pictures: u32, at: u64 },
    #[error("damaged: at byte {at}, after {pictures} pictures, {what}")]
    Damaged { pictures: u32, at: u64, what: &'static str },
}

/// Returns whether the regular file at `path` begins as a recording of OpenNI2 does.
pub fn is_recording(path: &Path) -> bool {
    let mut magic = [0; FILE_MAGIC.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic == *FILE_MAGIC
}

/// Checks that the recording at `path` is complete.
///
/// # Errors
/// What is wrong with it, for a person.
pub fn check_recording(path: &Path) -> Result<(), String> {
    check(path).map(|_| ()).map_err(|error| error.to_string())
}

/// Checks the records of the file at `path`: everything that the library's player relies on.
///
/// # Errors
/// Where the file cannot be read, is incomplete, or has an invalid record.
pub(crate) fn check(path: &Path) -> Result<OniSummary, OniFileError> {
    check_up_to(path, MAX_RECORDS)
}

/// Checks a file of at most `max_records` records, as [`check`].
fn check_up_to(path: &Path, max_records: usize) -> Result<OniSummary, OniFileError> {
    // Opening a named pipe would block.
    if !std::fs::metadata(path)?.is_file() {
        return Err(OniFileError::NotAFile);
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    check_records(&mut BufReader::with_capacity(BUFFER, file), length, max_records)
}

/// Checks the header and the records of a file of `length` bytes, as [`check_up_to`].
pub(crate) fn check_records(
    file: &mut (impl Read + Seek),
    length: u64,
    max_records: usize,
) -> Result<OniSummary, OniFileError> {
    check_header(file, length)?;
    let (mut streams, mut at) = (Streams::default(), FILE_HEADER);
    loop {
        let record = read_record(file, at, length, streams.pictures)?;
        let fields = read_fields(file, &record)?;
        if streams.record_count() >= max_records {
            return Err(OniFileError::TooManyRecords(max_records));
        }
        if let Err(what) = streams.add(&record, &fields) {
            return Err(OniFileError::Damaged { pictures: streams.pictures, at, what });
        }
        at = record.next();
        if record.kind == END {
            return Ok(OniSummary { pictures: streams.pictures, length: at });
        }
    }
}

/// Checks the header of a file of `length` bytes.
fn check_header(file: &mut impl Read, length: u64) -> Result<(), OniFileError> {
    let mut header = [0; FILE_HEADER as usize];
    let is_complete = read(file, &mut header)?;
    if !header.starts_with(FILE_MAGIC) {
        return Err(OniFileError::Magic);
    }
    if !is_complete {
        return Err(OniFileError::Truncated { pictures: 0, at: length });
    }
    let last_node = u32::from_le_bytes([header[20], header[21], header[22], header[23]]);
    if header[4] != 1 || !(1..=streams::MAX_STREAMS).contains(&last_node) {
        let what = "its header is of no version that is known";
        return Err(OniFileError::Damaged { pictures: 0, at: 4, what });
    }
    Ok(())
}

/// Reads the header of the record at byte `at` of a file of `length` bytes, after `pictures`
/// pictures.
fn read_record(
    file: &mut (impl Read + Seek),
    at: u64,
    length: u64,
    pictures: u32,
) -> Result<Record, OniFileError> {
    file.seek(SeekFrom::Start(at))?;
    let mut header = [0; RECORD_HEADER as usize];
    if !read(file, &mut header)? {
        return Err(OniFileError::Truncated { pictures, at });
    }
    let what = "there is no record";
    let record = Record::parse(&header, at).ok_or(OniFileError::Damaged { pictures, at, what })?;
    if record.next() > length {
        return Err(OniFileError::Truncated { pictures, at });
    }
    Ok(record)
}

/// Reads the fields of a record. Those of an index include its payload.
fn read_fields(file: &mut impl Read, record: &Record) -> io::Result<Vec<u8>> {
    let mut length = record.fields - RECORD_HEADER;
    if record.kind == INDEX && record.payload <= MAX_INDEX {
        length += record.payload;
    }
    let mut fields = vec![0; length as usize];
    file.read_exact(&mut fields)?;
    Ok(fields)
}

/// Cuts off the bytes behind the last record.
///
/// # Errors
/// Where the file is incomplete or cannot be written.
pub(crate) fn trim(path: &Path) -> Result<OniSummary, OniFileError> {
    let summary = check(path)?;
    OpenOptions::new().write(true).open(path)?.set_len(summary.length)?;
    Ok(summary)
}

/// Fills `bytes`. Returns `false` at the end of the file.
fn read(file: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}
