//! Tests of the check of `.oni` files.

use super::record::*;
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

fn summary(bytes: &[u8]) -> Result<OniSummary, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.oni");
    std::fs::write(&path, bytes).unwrap();
    let found = check(&path).map_err(|error| error.to_string());
    if let Ok(summary) = &found {
        trim(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().len(), summary.length);
    }
    found
}

#[test]
fn a_whole_file_is_counted_and_trimmed() {
    let mut bytes = whole();
    let length = bytes.len() as u64;
    assert_eq!(summary(&bytes), Ok(OniSummary { pictures: 2, length }));
    bytes.extend([1; 1000]);
    assert_eq!(summary(&bytes), Ok(OniSummary { pictures: 2, length }));
}

#[test]
fn only_regular_files_are_opened() {
    let error = check(Path::new("/dev/zero")).unwrap_err().to_string();
    assert!(error.contains("no regular file"), "{error}");
    assert!(matches!(check(&std::env::temp_dir()), Err(OniFileError::NotAFile)));
}

#[test]
fn a_file_of_too_many_records_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.oni");
    std::fs::write(&path, whole()).unwrap();
    // The stream, its size, its mode, ready, begin, two pictures, the index, the end.
    assert_eq!(check_up_to(&path, 9).unwrap().pictures, 2);
    let error = check_up_to(&path, 8).unwrap_err().to_string();
    assert!(error.contains("more than 8 records"), "{error}");
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused() {
    let bytes = whole();
    for length in 0..bytes.len() {
        let error = summary(&bytes[..length]).unwrap_err();
        let says = if length < 4 { "NI10" } else { "truncated" };
        assert!(error.contains(says), "{length}: {error}");
    }
}

#[test]
fn an_invalid_record_is_reported_with_its_place() {
    for (at, value) in [(24, 0), (28, 99), (28, 0), (36, 1), (36 + 3, 255)] {
        let mut bytes = whole();
        bytes[at] = value;
        assert!(summary(&bytes).unwrap_err().contains("damaged: at byte 24"), "{at}");
    }
}

#[test]
fn most_changed_bytes_outside_of_pictures_are_detected() {
    let bytes = whole();
    let free = (0..bytes.len()).filter(|&at| {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x40;
        summary(&bytes).is_ok()
    });
    let count = free.count();
    // Two pictures of 24 bytes; of the file's header 15; the stream's name, its time stamps,
    // the unused fields of its index; the counts where its pictures begin.
    assert!(count < 48 + 15 + 5 + 16 + 8 + 12 + 8, "{count} of {}", bytes.len());
}
