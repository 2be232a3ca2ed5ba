//! Entrance for the fuzz targets in `tests/fuzz` to the check of recordings.

use std::io::Cursor;

use crate::oni_file;

/// Most records of a recording.
const MAX_RECORDS: usize = 10_000;

/// Checks `bytes` as an `.oni` file. Returns the number of its pictures, and the bytes up to the
/// end of its last record; `None` where the file is damaged.
pub fn oni_file(bytes: &[u8]) -> Option<(u32, u64)> {
    let mut file = Cursor::new(bytes);
    let summary = oni_file::check_records(&mut file, bytes.len() as u64, MAX_RECORDS).ok()?;
    Some((summary.pictures, summary.length))
}
