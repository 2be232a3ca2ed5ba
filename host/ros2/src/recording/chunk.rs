//! Chunks of an MCAP file, and the records in them.
//!
//! `LinearReader` of the crate `mcap` (0.26.0) could unpack them too, but it panics at a record
//! that is longer than the rest of its chunk.

use mcap::records::ChunkHeader;
use mcap::{McapError, McapResult};
use ruzstd::decoding::FrameDecoder;

/// Bytes of a record before its content: the kind, and the length in 8 bytes.
const RECORD_HEADER: usize = 9;

/// Records of a chunk, some of which are read.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    bytes: Vec<u8>,
    /// Start of the next record in `bytes`.
    begin: usize,
}

impl Chunk {
    /// Unpacks the chunk with this header, whose content is `packed`. It may have `longest` bytes
    /// at most.
    ///
    /// # Errors
    /// Where it is longer, is compressed in another way than by zstd, or is damaged.
    pub(super) fn unpack(header: &ChunkHeader, packed: &[u8], longest: usize) -> McapResult<Self> {
        let size = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
        if size > longest {
            return Err(McapError::ChunkTooLarge(header.uncompressed_size));
        }
        let bytes = match header.compression.as_str() {
            "" => packed.to_vec(),
            "zstd" => decompressed(packed, size)?,
            other => return Err(McapError::UnsupportedCompression(other.to_owned())),
        };
        let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&bytes));
        if saved != 0 && saved != calculated {
            return Err(McapError::BadChunkCrc { saved, calculated });
        }
        Ok(Self { bytes, begin: 0 })
    }

    /// Returns the kind and the content of the next record; `None` at the end.
    ///
    /// # Errors
    /// Where the chunk ends within it.
    pub(super) fn next(&mut self) -> McapResult<Option<(u8, &[u8])>> {
        let rest = &self.bytes[self.begin..];
        if rest.is_empty() {
            return Ok(None);
        }
        let (header, rest) =
            rest.split_first_chunk::<RECORD_HEADER>().ok_or(McapError::UnexpectedEoc)?;
        let [kind, length @ ..] = *header;
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let content = rest.get(..length).ok_or(McapError::UnexpectedEoc)?;
        self.begin += RECORD_HEADER + length;
        Ok(Some((kind, content)))
    }
}

/// Returns `size` bytes that zstd has compressed to `packed`.
fn decompressed(packed: &[u8], size: usize) -> McapResult<Vec<u8>> {
    let refused = |error: String| McapError::DecompressionError(error);
    let mut bytes = vec![0; size];
    let written = FrameDecoder::new().decode_all(packed, &mut bytes);
    let written = written.map_err(|error| refused(error.to_string()))?;
    if written != size {
        return Err(refused(format!("{written} bytes in place of {size}")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(compression: &str, size: u64) -> ChunkHeader {
        ChunkHeader {
            message_start_time: 0,
            message_end_time: 0,
            uncompressed_size: size,
            uncompressed_crc: 0,
            compression: compression.to_owned(),
            compressed_size: 0,
        }
    }

    fn error(header: &ChunkHeader, packed: &[u8]) -> String {
        Chunk::unpack(header, packed, 5000).unwrap_err().to_string()
    }

    /// A chunk as `zstd` compresses it: 3000 zeros, by `head -c 3000 /dev/zero | zstd -19`.
    #[test]
    fn zstd_is_decompressed_to_the_size_of_the_header_only() {
        let packed = include_bytes!("zeros.zst");
        assert_eq!(Chunk::unpack(&header("zstd", 3000), packed, 3000).unwrap().bytes, [0; 3000]);
        for size in [0, 2999, 3001] {
            assert!(Chunk::unpack(&header("zstd", size), packed, 5000).is_err(), "{size}");
        }
        assert!(error(&header("zstd", 10), b"no zstd at all").contains("ecompress"));
        assert!(error(&header("zstd", u64::MAX), packed).contains(&u64::MAX.to_string()));
        assert!(error(&header("lz4", 10), &[0; 10]).contains("lz4"));
        assert!(
            error(&ChunkHeader { uncompressed_crc: 1, ..header("", 3) }, b"abc").contains("CRC")
        );
    }

    #[test]
    fn a_record_is_never_longer_than_the_rest_of_its_chunk() {
        let record = |length: u64| [&[7][..], &length.to_le_bytes(), b"ab"].concat();
        let mut sound = Chunk::unpack(&header("", 0), &record(2).repeat(2), 5000).unwrap();
        assert_eq!(sound.next().unwrap(), Some((7, &b"ab"[..])));
        assert_eq!(sound.next().unwrap(), Some((7, &b"ab"[..])));
        assert_eq!(sound.next().unwrap(), None);
        for damaged in [record(3), record(u64::MAX), record(2)[..5].to_vec()] {
            assert!(Chunk::unpack(&header("", 0), &damaged, 5000).unwrap().next().is_err());
        }
    }
}
