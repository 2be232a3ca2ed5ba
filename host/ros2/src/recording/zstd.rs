//! Chunks of an MCAP file that are compressed with zstd.

use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

/// Compressed bytes that hold a whole block with its header: 128 KiB at most (RFC 8878, section
/// 3.1.1.2.3), 3 bytes before it, and the frame's header of 18 bytes.
const WHOLE_BLOCK: usize = (128 << 10) + 3 + 18;

/// Decompressor of zstd in Rust alone.
#[derive(Default)]
pub(super) struct Zstd {
    decoder: Option<FrameDecoder>,
}

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        WHOLE_BLOCK
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let refused = |error: &dyn ToString| McapError::DecompressionError(error.to_string());
        let mut rest = src;
        let decoder = match &mut self.decoder {
            Some(decoder) => decoder,
            None => {
                let mut decoder = FrameDecoder::new();
                decoder.init(&mut rest).map_err(|error| refused(&error))?;
                self.decoder.insert(decoder)
            }
        };
        // Blocks are decoded only where none waits to be written, so that memory stays bounded.
        if decoder.can_collect() == 0 && !decoder.is_finished() {
            let one = BlockDecodingStrategy::UptoBlocks(1);
            decoder.decode_blocks(&mut rest, one).map_err(|error| refused(&error))?;
        }
        let wrote = std::io::Read::read(decoder, dst).map_err(|error| refused(&error))?;
        if decoder.is_finished() && decoder.can_collect() == 0 {
            // A further frame may follow.
            self.decoder = None;
        }
        Ok(DecompressResult { consumed: src.len() - rest.len(), wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.decoder = None;
        Ok(())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}
