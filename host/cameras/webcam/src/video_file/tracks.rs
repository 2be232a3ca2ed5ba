//! Video tracks of a Matroska file. OpenCV reads the first one only.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Length of the start of a file that is read, bytes. The tracks are described there.
const HEADER: u64 = 1 << 20;

/// Elements with other elements in them, of RFC 9559: Segment, Tracks, TrackEntry.
const MASTERS: [u64; 3] = [0x1853_8067, 0x1654_AE6B, 0xAE];

/// Element TrackType (RFC 9559, section 5.1.4.1.3).
const TRACK_TYPE: u64 = 0x83;

/// Value of TrackType for video.
const VIDEO: &[u8] = &[1];

/// Returns the number of video tracks of the file at `path`; 0 where it is no Matroska file.
///
/// # Errors
/// Where the file cannot be read.
pub(crate) fn video_tracks(path: &Path) -> io::Result<usize> {
    let mut header = Vec::new();
    File::open(path)?.take(HEADER).read_to_end(&mut header)?;
    Ok(if header.starts_with(&[0x1A, 0x45, 0xDF, 0xA3]) { count(&header) } else { 0 })
}

/// Returns the number of video tracks in a sequence of elements, which may be cut off.
fn count(mut elements: &[u8]) -> usize {
    let mut tracks = 0;
    while let Some((id, size, rest)) = head(elements) {
        let (content, next) = rest.split_at(size.min(rest.len()));
        tracks += match id {
            TRACK_TYPE => usize::from(content == VIDEO),
            id if MASTERS.contains(&id) => count(content),
            _ => 0,
        };
        elements = next;
    }
    tracks
}

/// Returns the id of an element, the size of its content, and what follows both.
fn head(bytes: &[u8]) -> Option<(u64, usize, &[u8])> {
    let (id, _, rest) = number(bytes)?;
    let (_, size, rest) = number(rest)?;
    Some((id, usize::try_from(size).unwrap_or(usize::MAX), rest))
}

/// Returns a number of variable length (RFC 8794, section 4) with its marker and without it, and
/// what follows. An unknown size, with all bits set, is large.
fn number(bytes: &[u8]) -> Option<(u64, u64, &[u8])> {
    let length = bytes.first()?.leading_zeros() as usize + 1;
    let (number, rest) = bytes.split_at_checked(length).filter(|_| length <= 8)?;
    let marked = number.iter().fold(0, |value, byte| value << 8 | u64::from(*byte));
    Some((marked, marked & !(1 << (7 * length)), rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_cut_off_or_damaged_ends_early() {
        // Segment of unknown size, Tracks, and two entries, the second of which is cut off.
        let bytes = [
            0x18, 0x53, 0x80, 0x67, 0xFF, 0x16, 0x54, 0xAE, 0x6B, 0x8A, 0xAE, 0x83, 0x83, 0x81, 1,
            0xAE, 0x83, 0x83, 0x81, 1,
        ];
        assert_eq!(count(&bytes), 2);
        assert_eq!(count(&bytes[..bytes.len() - 1]), 1);
        for length in 0..bytes.len() {
            assert!(count(&bytes[..length]) <= 2);
            let mut damaged = bytes;
            damaged[length] = 0;
            assert!(count(&damaged) <= 2);
        }
    }
}
