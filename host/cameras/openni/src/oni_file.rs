//! The skeleton of an `.oni` file, looked at before the library is given it: the library reads a
//! damaged one past its own memory, and says of a truncated one only that it failed.
//!
//! A file is a header of 24 bytes and records, all little-endian: magic `NIR\0`, type, node, bytes
//! of header and fields, bytes of payload (32 bits each), position of an undo record (64 bits);
//! then fields and payload.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use thiserror::Error;

use crate::oni_node::{Fields, Node};

const FILE_MAGIC: &[u8; 4] = b"NI10";
const FILE_HEADER: u64 = 24;
const RECORD_MAGIC: &[u8; 4] = b"NIR\0";
const RECORD_HEADER: u64 = 28;
/// No fields are so long: names and properties.
const LONGEST_FIELDS: u64 = 1 << 16;
/// Types of records. A node is a stream.
const NUMBER: u32 = 3;
const REAL: u32 = 4;
const TEXT: u32 = 5;
const GENERAL: u32 = 6;
const NODE_REMOVED: u32 = 7;
const DATA_BEGINS: u32 = 8;
const READY: u32 = 9;
const NEW_DATA: u32 = 10;
const END: u32 = 11;
const NODE_ADDED: u32 = 13;
const INDEX: u32 = 14;
/// Streams in a file at most: colour, depth, infrared, and some of another kind.
const MOST_NODES: u32 = 8;
/// Most records of a file: colour and depth at 30 Hz for a day.
const MOST_RECORDS: usize = 6_000_000;
/// No index is so long: it has an entry of 20 bytes for each record.
const LONGEST_INDEX: u64 = 20 * MOST_RECORDS as u64;

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
    #[error("it is no regular file")]
    NotAFile,
    #[error("it has more than {0} records: split the recording")]
    TooManyRecords(usize),
    #[error("it is no .oni recording (its first bytes are not NI10)")]
    Magic,
    #[error(
        "damaged or truncated: it ends after {pictures} pictures, at byte {at}, without the record that closes it"
    )]
    Truncated { pictures: u32, at: u64 },
    #[error("damaged: at byte {at}, after {pictures} pictures, {what}")]
    Damaged { pictures: u32, at: u64, what: &'static str },
}

/// Looks through the records of the file at `path`: all that the library will take for granted.
///
/// # Errors
/// Where it cannot be read, is not whole, or says what cannot be.
pub(crate) fn examine(path: &Path) -> Result<Skeleton, SkeletonError> {
    examine_up_to(path, MOST_RECORDS)
}

/// As [`examine`], of at most `most_records`.
fn examine_up_to(path: &Path, most_records: usize) -> Result<Skeleton, SkeletonError> {
    // A named pipe would be waited for, and so it is not opened.
    if !std::fs::metadata(path)?.is_file() {
        return Err(SkeletonError::NotAFile);
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut file = BufReader::with_capacity(256, file);
    let mut header = [0; FILE_HEADER as usize];
    let whole = read(&mut file, &mut header)?;
    if !header.starts_with(FILE_MAGIC) {
        return Err(SkeletonError::Magic);
    }
    let mut records = Records { nodes: BTreeMap::new(), starts: Vec::new(), pictures: 0 };
    if !whole {
        return Err(SkeletonError::Truncated { pictures: 0, at: length });
    }
    let last_node = u32::from_le_bytes([header[20], header[21], header[22], header[23]]);
    if header[4] != 1 || !(1..=MOST_NODES).contains(&last_node) {
        return Err(records.damaged(4, "its header is of no version that is known"));
    }
    let mut at = FILE_HEADER;
    loop {
        file.seek(SeekFrom::Start(at))?;
        let mut header = [0; RECORD_HEADER as usize];
        if !read(&mut file, &mut header)? {
            return Err(SkeletonError::Truncated { pictures: records.pictures, at });
        }
        let record =
            Record::of(&header, at).ok_or_else(|| records.damaged(at, "there is no record"))?;
        if record.next() > length {
            return Err(SkeletonError::Truncated { pictures: records.pictures, at });
        }
        let mut fields = vec![0; (record.fields - RECORD_HEADER) as usize];
        file.read_exact(&mut fields)?;
        if record.kind == INDEX && record.payload <= LONGEST_INDEX {
            fields.resize(fields.len() + record.payload as usize, 0);
            file.read_exact(&mut fields)?;
        }
        if records.starts.len() >= most_records {
            return Err(SkeletonError::TooManyRecords(most_records));
        }
        records.take(&record, &fields).map_err(|what| records.damaged(at, what))?;
        at = record.next();
        if record.kind == END {
            return Ok(Skeleton { pictures: records.pictures, length: at });
        }
    }
}

/// The header of a record.
struct Record {
    kind: u32,
    node: u32,
    /// Bytes of header and fields, and of what comes behind.
    fields: u64,
    payload: u64,
    /// The record that this one undoes, 0 where there is none.
    undone: u64,
    at: u64,
}

impl Record {
    fn of(header: &[u8; RECORD_HEADER as usize], at: u64) -> Option<Self> {
        let mut numbers = Fields(header.strip_prefix(RECORD_MAGIC)?);
        let [kind, node, fields, payload] =
            [numbers.u32()?, numbers.u32()?, numbers.u32()?, numbers.u32()?];
        let (fields, payload, undone) = (u64::from(fields), u64::from(payload), numbers.u64()?);
        (RECORD_HEADER..=LONGEST_FIELDS).contains(&fields).then_some(Self {
            kind,
            node,
            fields,
            payload,
            undone,
            at,
        })
    }

    fn next(&self) -> u64 {
        self.at + self.fields + self.payload
    }
}

/// What has been read so far.
struct Records {
    nodes: BTreeMap<u32, Node>,
    /// Where the records are.
    starts: Vec<u64>,
    pictures: u32,
}

impl Records {
    fn damaged(&self, at: u64, what: &'static str) -> SkeletonError {
        SkeletonError::Damaged { pictures: self.pictures, at, what }
    }

    /// Takes in the next record; what is wrong with it otherwise.
    fn take(&mut self, record: &Record, fields: &[u8]) -> Result<(), &'static str> {
        let has_payload = matches!(record.kind, NEW_DATA | INDEX);
        if !has_payload && record.payload != 0 {
            return Err("a record has data that has none");
        }
        if record.undone != 0 && self.starts.binary_search(&record.undone).is_err() {
            return Err("a record undoes one that is not there");
        }
        self.starts.push(record.at);
        match record.kind {
            NODE_ADDED => {
                let node =
                    Node::added(Fields(fields)).ok_or("a stream is of no kind that is known")?;
                let fresh = (1..=MOST_NODES).contains(&record.node)
                    && self.nodes.insert(record.node, node).is_none();
                return fresh.then_some(()).ok_or("a stream has the number of another");
            }
            END => {
                let whole = self.nodes.values().all(Node::is_whole) && fields.is_empty();
                return whole
                    .then_some(())
                    .ok_or("pictures or an index that are promised are not there");
            }
            _ => {}
        }
        let node =
            self.nodes.get_mut(&record.node).ok_or("a record is of a stream that is not there")?;
        let good = match record.kind {
            NUMBER | REAL | TEXT | GENERAL => {
                return node
                    .property(Fields(fields), matches!(record.kind, NUMBER | REAL))
                    .ok_or("a property is not what it can be");
            }
            DATA_BEGINS => fields.len() == 12 && node.is_ready(),
            READY => fields.is_empty() && node.is_ready(),
            NODE_REMOVED => fields.is_empty(),
            NEW_DATA => {
                self.pictures += 1;
                let taken = node.picture(Fields(fields), record.payload, record.at);
                return taken.ok_or("a picture is out of order or of a size that it cannot have");
            }
            INDEX => {
                let taken = node.index(fields, record.at);
                return taken.ok_or("the index is not that of the pictures");
            }
            _ => return Err("there is a record of no kind that is known"),
        };
        good.then_some(()).ok_or("a stream's pictures cannot begin or end here")
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

    const RAW: &[u8; 4] = b"NONE";

    fn record(kind: u32, node: u32, fields: &[u8], payload: &[u8]) -> Vec<u8> {
        let mut bytes = RECORD_MAGIC.to_vec();
        for word in [kind, node, 28 + fields.len() as u32, payload.len() as u32, 0, 0] {
            bytes.extend(word.to_le_bytes());
        }
        [&bytes, fields, payload].concat()
    }

    fn name(text: &str) -> Vec<u8> {
        [&(text.len() as u32 + 1).to_le_bytes(), text.as_bytes(), &[0]].concat()
    }

    fn property(kind: u32, of: &str, value: &[u8]) -> Vec<u8> {
        record(kind, 1, &[&name(of), &(value.len() as u32).to_le_bytes()[..], value].concat(), &[])
    }

    /// A recording of two pictures of 4 x 3 pixels of depth, uncompressed.
    fn whole() -> Vec<u8> {
        let words = |of: &[u32]| of.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let mut bytes =
            [FILE_MAGIC.as_slice(), &[1, 0, 1, 0, 0, 0, 0, 0], &[255; 8], &words(&[1])].concat();
        let added = bytes.len() + 28 + 4 + 6 + 4 + 4 + 4 + 16;
        let fields =
            [name("Depth"), words(&[2]), RAW.to_vec(), words(&[2, 0, 0, 33, 0, 0, 0])].concat();
        bytes.extend(record(NODE_ADDED, 1, &fields, &[]));
        bytes.extend(property(NUMBER, "oniRequiredFrameSize", &24_u64.to_le_bytes()));
        bytes.extend(property(GENERAL, "xnMapOutputMode", &words(&[4, 3, 30])));
        bytes.extend(record(READY, 1, &[], &[]));
        bytes.extend(record(DATA_BEGINS, 1, &[255; 12], &[]));
        let mut index = vec![0; 20];
        for (number, time) in [(1, 0), (2, 33)] {
            index.extend(words(&[time, 0, 0, bytes.len() as u32, 0]));
            bytes.extend(record(NEW_DATA, 1, &words(&[time, 0, number]), &[7; 24]));
        }
        let at = bytes.len() as u64;
        bytes[added..added + 8].copy_from_slice(&at.to_le_bytes());
        bytes.extend(record(INDEX, 1, &[], &index));
        bytes.extend(record(END, 0, &[], &[]));
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
    fn what_is_no_regular_file_is_not_opened() {
        let error = examine(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(error.contains("no regular file"), "{error}");
        assert!(matches!(examine(&std::env::temp_dir()), Err(SkeletonError::NotAFile)));
    }

    #[test]
    fn a_file_of_too_many_records_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.oni");
        std::fs::write(&path, whole()).unwrap();
        // The stream, its size, its mode, ready, begin, two pictures, the index, the end.
        assert_eq!(examine_up_to(&path, 9).unwrap().pictures, 2);
        let error = examine_up_to(&path, 8).unwrap_err().to_string();
        assert!(error.contains("more than 8 records"), "{error}");
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

    #[test]
    fn every_other_byte_but_those_of_pictures_and_of_what_nobody_reads_is_missed() {
        let bytes = whole();
        let free = (0..bytes.len()).filter(|&at| {
            let mut bytes = bytes.clone();
            bytes[at] ^= 0x40;
            of(&bytes).is_ok()
        });
        let count = free.count();
        // Two pictures of 24 bytes; of the file's header 15; the stream's name, its time stamps,
        // what is unused in its index; the counts where its pictures begin.
        assert!(count < 48 + 15 + 5 + 16 + 8 + 12 + 8, "{count} of {}", bytes.len());
    }
}
