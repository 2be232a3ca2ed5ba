//! The file of a report: a tar archive, compressed with gzip. It has no owner and no time.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, Header};

use super::parts::Part;
use crate::cli::exit::{Failure, failed};

/// Folder of the parts in the archive.
const FOLDER: &str = "plumb-report";

/// First bytes of a file that is compressed with gzip (RFC 1952, section 2.3.1).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Checks that a report can take the place of what is at `path`: nothing, or a former report.
///
/// # Errors
/// Where another file or a folder is there.
pub(super) fn check_replaceable(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(failed(format!("{}: is a folder; name a file", path.display())));
    }
    if path.exists() && !is_gzip(path) {
        let why = "exists already and is no report; give another name, or move it away";
        return Err(failed(format!("{}: {why}", path.display())));
    }
    Ok(())
}

/// Returns whether a file begins as one that is compressed with gzip.
fn is_gzip(path: &Path) -> bool {
    let mut begin = [0; GZIP.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut begin));
    read.is_ok() && begin == GZIP
}

/// Returns the archive of some parts.
///
/// # Errors
/// Where a name is too long for the format.
pub(super) fn pack(parts: &[Part]) -> io::Result<Vec<u8>> {
    let mut archive = Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
    for part in parts {
        let mut header = Header::new_ustar();
        header.set_size(part.bytes.len() as u64);
        header.set_mode(0o644);
        header.set_uid(0);
        header.set_gid(0);
        header.set_mtime(0);
        archive.append_data(
            &mut header,
            format!("{FOLDER}/{}", part.name),
            part.bytes.as_slice(),
        )?;
    }
    archive.into_inner()?.finish()
}
