//! The weights file: lines of text that say where the weights come from, an empty line, and the
//! weights as f32, least significant byte first.

/// End of the text.
const END_OF_TEXT: &[u8] = b"\n\n";

/// A reader of the weights, layer by layer.
pub(super) struct Weights<'a> {
    bytes: &'a [u8],
}

impl<'a> Weights<'a> {
    /// Starts to read a file.
    ///
    /// # Panics
    /// Panics if the file has no text or no weights. The file is a part of the program.
    pub(super) fn new(file: &'a [u8]) -> Self {
        let text = file.windows(END_OF_TEXT.len()).position(|part| part == END_OF_TEXT);
        let start = text.map_or(file.len(), |end| end + END_OF_TEXT.len());
        assert!(start < file.len(), "the weights file is text and weights");
        Self { bytes: &file[start..] }
    }

    /// Returns the next `count` weights.
    ///
    /// # Panics
    /// Panics if fewer are left.
    pub(super) fn take(&mut self, count: usize) -> Vec<f32> {
        let (taken, left) = self.bytes.split_at(4 * count);
        self.bytes = left;
        taken.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    }

    /// Checks that all weights were read.
    ///
    /// # Panics
    /// Panics if some are left.
    pub(super) fn finish(self) {
        assert!(self.bytes.is_empty(), "the weights file is longer than the networks");
    }
}
