//! The file of a report: a tar archive (POSIX.1-1988, "ustar"), compressed with gzip. It has no
//! owner and no time.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::GzEncoder;

use super::parts::Part;

/// Folder of the parts in the archive.
const FOLDER: &str = "plumb-report";

/// Bytes of a block of the archive.
const BLOCK: usize = 512;

/// Returns the archive of some parts.
///
/// # Errors
/// Where a name or a part is too long for the format.
pub(super) fn pack(parts: &[Part]) -> io::Result<Vec<u8>> {
    let mut archive = GzEncoder::new(Vec::new(), Compression::default());
    for part in parts {
        archive.write_all(&header(part)?)?;
        archive.write_all(part.text.as_bytes())?;
        let rest = part.text.len() % BLOCK;
        archive.write_all(&[0; BLOCK][..(BLOCK - rest) % BLOCK])?;
    }
    // Two empty blocks end it.
    archive.write_all(&[0; 2 * BLOCK])?;
    archive.finish()
}

/// Returns the header of a part.
fn header(part: &Part) -> io::Result<[u8; BLOCK]> {
    let mut header = [0; BLOCK];
    let mut put = |offset: usize, width: usize, text: &str| {
        if text.len() > width {
            return Err(io::Error::other(format!("{text}: too long for a report")));
        }
        header[offset..offset + text.len()].copy_from_slice(text.as_bytes());
        Ok(())
    };
    put(0, 100, &format!("{FOLDER}/{}", part.name))?;
    put(100, 7, "0000644")?;
    for id in [108, 116] {
        put(id, 7, "0000000")?;
    }
    put(124, 11, &format!("{:011o}", part.text.len()))?;
    put(136, 11, "00000000000")?;
    put(148, 8, "        ")?;
    put(156, 1, "0")?;
    put(257, 5, "ustar")?;
    put(263, 2, "00")?;
    let sum: u32 = header.iter().copied().map(u32::from).sum();
    header[148..155].copy_from_slice(format!("{sum:06o}\0").as_bytes());
    Ok(header)
}
