//! The file of a report: a tar archive, compressed with gzip. It has no owner and no time.

use std::io;

use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, Header};

use super::parts::Part;

/// Folder of the parts in the archive.
const FOLDER: &str = "plumb-report";

/// Returns the archive of some parts.
///
/// # Errors
/// Where a name is too long for the format.
pub(super) fn pack(parts: &[Part]) -> io::Result<Vec<u8>> {
    let mut archive = Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
    for part in parts {
        let mut header = Header::new_ustar();
        header.set_size(part.bytes().len() as u64);
        header.set_mode(0o644);
        header.set_uid(0);
        header.set_gid(0);
        header.set_mtime(0);
        archive.append_data(&mut header, format!("{FOLDER}/{}", part.name), part.bytes())?;
    }
    archive.into_inner()?.finish()
}
