//! Check of the records of one stream, which the library's player trusts.
//!
//! Strings are a length (32 bits, with the closing zero) and characters. A stream is added with
//! name, type, codec, number of pictures, first and last time stamp, and where its index is; a
//! property has name, length and value; a picture has time stamp and number; the index has a time
//! stamp, a number that nobody uses, and a position for each picture, and for none before them.

use super::record::Fields;

/// Type of a depth stream.
const DEPTH: u32 = 2;
/// Type of a colour stream.
const COLOUR: u32 = 3;
/// Known codecs, by four letters.
const CODECS: [&[u8; 4]; 5] = [b"NONE", b"16zP", b"16zT", b"Im8z", b"JPEG"];
/// Codec of uncompressed pictures.
const RAW: &[u8; 4] = b"NONE";
/// Most columns or rows of a picture.
const MAX_SIDE: u32 = 4096;
/// Highest rate, Hz.
const MAX_RATE: u32 = 1000;
/// Bytes of a mode: columns, rows, rate.
const MODE_BYTES: usize = 12;
/// Bytes of an entry of the index.
const ENTRY_BYTES: usize = 20;
/// Most bytes of a pixel, in any format.
const MAX_PIXEL_BYTES: u64 = 4;
/// Most bytes of a compressed picture: this multiple of its uncompressed size, ...
const MAX_COMPRESSED_RATIO: u64 = 2;
/// ... and this number of bytes for headers.
const MAX_COMPRESSED_HEADER: u64 = 4096;

/// Position of a picture's record, and its time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Picture {
    at: u64,
    time: u64,
}

/// Stream, as far as its records have been read.
#[derive(Debug)]
pub(super) struct Node {
    codec: [u8; 4],
    /// Number of pictures that the stream states.
    promised: u32,
    /// Position of the index.
    index_at: u64,
    /// Bytes of a picture that the stream states.
    frame_size: Option<u64>,
    /// Columns, rows and rate.
    mode: Option<[u32; 3]>,
    /// Number of modes that the stream states, and of those that it lists.
    modes: Option<(u64, Option<u64>)>,
    pictures: Vec<Picture>,
    has_index: bool,
}

impl Node {
    /// Parses the record that adds a stream; `None` where it is invalid.
    pub(super) fn added(mut fields: Fields) -> Option<Self> {
        fields.name()?;
        let kind = fields.u32()?;
        let codec: [u8; 4] = fields.bytes(4)?.try_into().ok()?;
        let (promised, first, last, index_at) =
            (fields.u32()?, fields.u64()?, fields.u64()?, fields.u64()?);
        fields.end()?;
        let known = matches!(kind, DEPTH | COLOUR) && CODECS.iter().any(|c| **c == codec);
        (known && first <= last).then_some(Self {
            codec,
            promised,
            index_at,
            frame_size: None,
            mode: None,
            modes: None,
            pictures: Vec::new(),
            has_index: false,
        })
    }

    /// Adds a property; `None` where it is invalid. The value is checked too where the player
    /// computes with it. A `numeric` value has 8 bytes.
    pub(super) fn property(&mut self, mut fields: Fields, numeric: bool) -> Option<()> {
        let name = fields.name()?;
        let length = fields.u32()? as usize;
        let mut value = Fields(fields.bytes(length)?);
        fields.end()?;
        if numeric && length != 8 {
            return None;
        }
        let text = std::str::from_utf8(name).ok()?;
        match (text, numeric) {
            ("oniRequiredFrameSize", true) => self.frame_size = Some(value.u64()?),
            ("xnMapOutputMode", false) => {
                self.mode = Some([value.u32()?, value.u32()?, value.u32()?]);
                value.end()?;
            }
            ("xnSupportedMapOutputModesCount", true) => self.modes = Some((value.u64()?, None)),
            ("xnSupportedMapOutputModes", false) => {
                let (count, _) = self.modes?;
                self.modes = Some((count, Some((length / MODE_BYTES) as u64)));
                length.is_multiple_of(MODE_BYTES).then_some(())?;
            }
            ("oniPixelFormat", true) => {
                matches!(value.u64()?, 100..=103 | 200..=205).then_some(())?
            }
            ("Mirror" | "xnMirror" | "xnIsGenerating", true) => (value.u64()? <= 1).then_some(())?,
            ("xnFOV", false) => {
                let finite = |angle: f64| (0.0..std::f64::consts::PI).contains(&angle);
                let angles = [f64::from_bits(value.u64()?), f64::from_bits(value.u64()?)];
                (value.0.is_empty() && angles.into_iter().all(finite)).then_some(())?;
            }
            // Another name with these prefixes is a damaged one.
            (name, _) if name.starts_with("xn") || name.starts_with("oni") => {
                KNOWN.contains(&name).then_some(())?;
            }
            _ => {}
        }
        Some(())
    }

    /// Adds the next picture, whose record is at byte `at`; `None` where it is invalid.
    pub(super) fn picture(&mut self, mut fields: Fields, payload: u64, at: u64) -> Option<()> {
        let (time, number) = (fields.u64()?, fields.u32()?);
        fields.end()?;
        let [columns, rows, rate] = self.mode.unwrap_or([MAX_SIDE, MAX_SIDE, 1]);
        let sides = [columns, rows].into_iter().all(|side| (1..=MAX_SIDE).contains(&side));
        (sides && (1..=MAX_RATE).contains(&rate)).then_some(())?;
        let whole = u64::from(columns) * u64::from(rows);
        let size = self.frame_size.unwrap_or(whole * MAX_PIXEL_BYTES);
        (whole..=whole * MAX_PIXEL_BYTES).contains(&size).then_some(())?;
        let fits = if &self.codec == RAW {
            payload == size
        } else {
            payload <= MAX_COMPRESSED_RATIO * size + MAX_COMPRESSED_HEADER
        };
        let last = self.pictures.last().map_or(0, |picture| picture.time);
        let next = self.pictures.len() as u32 + 1;
        (fits && time >= last && number == next).then_some(())?;
        self.pictures.push(Picture { at, time });
        Some(())
    }

    /// Returns whether the stream can be played. To be called before its first picture.
    pub(super) fn is_ready(&self) -> bool {
        self.modes.is_none_or(|(count, listed)| listed == Some(count) && count > 0)
            && (self.frame_size.is_some() == self.mode.is_some())
    }

    /// Adds the index, whose record is at byte `at`; `None` where it is invalid.
    pub(super) fn index(&mut self, payload: &[u8], at: u64) -> Option<()> {
        let (entries, rest) = payload.as_chunks::<ENTRY_BYTES>();
        (rest.is_empty() && entries.len() == self.pictures.len() + 1 && at == self.index_at)
            .then_some(())?;
        let (first, entries) = entries.split_first()?;
        first.iter().all(|byte| *byte == 0).then_some(())?;
        for (entry, picture) in entries.iter().zip(&self.pictures) {
            let mut fields = Fields(entry);
            let (time, _, position) = (fields.u64()?, fields.u32()?, fields.u64()?);
            (Picture { at: position, time } == *picture).then_some(())?;
        }
        self.has_index = true;
        Some(())
    }

    /// Returns whether all pictures and the index that the stream states exist.
    pub(super) fn is_complete(&self) -> bool {
        self.promised as usize == self.pictures.len() && (self.has_index || self.index_at == 0)
    }
}

/// Names of the library's other properties.
const KNOWN: [&str; 14] = [
    "xnBytesPerPixel",
    "xnCropping",
    "xnDeviceMaxDepth",
    "xnFrameID",
    "xnFrameSyncedWith",
    "xnNewData",
    "xnPixelFormat",
    "xnRealWorldTranslationData",
    "xnStateReady",
    "xnSupportedPixelFormats",
    "xnSupportedUserPositionsCount",
    "xnTimeStamp",
    "xnUserPositions",
    "xnCompression",
];
