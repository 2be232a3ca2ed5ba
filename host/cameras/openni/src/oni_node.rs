//! What the records of an `.oni` file say of one of its streams, and whether that can be: the
//! library believes all of it.
//!
//! Strings are a length (32 bits, with the closing zero) and characters. A stream is added with
//! name, type, codec, number of pictures, first and last time stamp, and where its index is; a
//! property has name, length and value; a picture has time stamp and number; the index has a time
//! stamp, a number that nobody uses, and a position for each picture, and for none before them.

/// The stream is depth, or colour.
const DEPTH: u32 = 2;
const COLOUR: u32 = 3;
/// Codecs that are known: four letters.
const CODECS: [&[u8; 4]; 5] = [b"NONE", b"16zP", b"16zT", b"Im8z", b"JPEG"];
const RAW: &[u8; 4] = b"NONE";
/// No name is so long.
const LONGEST_NAME: usize = 256;
/// No picture has more columns or rows, or comes faster.
const LARGEST_SIDE: u32 = 4096;
const FASTEST: u32 = 1000;
/// Bytes of a mode (columns, rows, rate), and of an entry of the index.
const MODE: usize = 12;
const ENTRY: usize = 20;
/// A pixel of any format has no more bytes.
const PIXEL: u64 = 4;
/// Compressed pictures may be larger than others by so many bytes, and by this part of 1.
const HEADER: u64 = 4096;
const GROWN: u64 = 2;

/// A picture: where its record is, and its time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Picture {
    at: u64,
    time: u64,
}

/// A stream as far as it has been read.
#[derive(Debug)]
pub(crate) struct Node {
    codec: [u8; 4],
    promised: u32,
    index_at: u64,
    /// Bytes of a picture, as the file says.
    frame_size: Option<u64>,
    mode: Option<[u32; 3]>,
    modes: Option<(u64, Option<u64>)>,
    pictures: Vec<Picture>,
    has_index: bool,
}

/// Reads numbers and strings from the fields of a record.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.bytes(4)?.try_into().ok()?))
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.bytes(8)?.try_into().ok()?))
    }

    /// A name: printable, with its closing zero and no other.
    fn name(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.u32()?).ok().filter(|length| *length <= LONGEST_NAME)?;
        let (zero, name) = self.bytes(length)?.split_last()?;
        (*zero == 0 && !name.is_empty() && name.iter().all(|c| c.is_ascii_graphic() || *c == b' '))
            .then_some(name)
    }

    fn end(&self) -> Option<()> {
        self.0.is_empty().then_some(())
    }
}

impl Node {
    /// As it is added; `None` where that is none.
    pub(crate) fn added(mut fields: Fields) -> Option<Self> {
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

    /// Takes in a property: of those that the player computes with the value too. `numeric` ones
    /// are of 8 bytes.
    pub(crate) fn property(&mut self, mut fields: Fields, numeric: bool) -> Option<()> {
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
                self.modes = Some((count, Some((length / MODE) as u64)));
                length.is_multiple_of(MODE).then_some(())?;
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
            // A name that is nearly one of these is one of these, damaged.
            (name, _) if name.starts_with("xn") || name.starts_with("oni") => {
                KNOWN.contains(&name).then_some(())?;
            }
            _ => {}
        }
        Some(())
    }

    /// Takes in the next picture's record at byte `at`.
    pub(crate) fn picture(&mut self, mut fields: Fields, payload: u64, at: u64) -> Option<()> {
        let (time, number) = (fields.u64()?, fields.u32()?);
        fields.end()?;
        let [columns, rows, rate] = self.mode.unwrap_or([LARGEST_SIDE, LARGEST_SIDE, 1]);
        let sides = [columns, rows].into_iter().all(|side| (1..=LARGEST_SIDE).contains(&side));
        (sides && (1..=FASTEST).contains(&rate)).then_some(())?;
        let whole = u64::from(columns) * u64::from(rows);
        let size = self.frame_size.unwrap_or(whole * PIXEL);
        (whole..=whole * PIXEL).contains(&size).then_some(())?;
        let fits =
            if &self.codec == RAW { payload == size } else { payload <= GROWN * size + HEADER };
        let last = self.pictures.last().map_or(0, |picture| picture.time);
        let next = self.pictures.len() as u32 + 1;
        (fits && time >= last && number == next).then_some(())?;
        self.pictures.push(Picture { at, time });
        Some(())
    }

    /// Whether it could be played: to be asked before its first picture.
    pub(crate) fn is_ready(&self) -> bool {
        self.modes.is_none_or(|(count, listed)| listed == Some(count) && count > 0)
            && (self.frame_size.is_some() == self.mode.is_some())
    }

    /// Takes in its index, whose record is at byte `at`.
    pub(crate) fn index(&mut self, payload: &[u8], at: u64) -> Option<()> {
        let (entries, rest) = payload.as_chunks::<ENTRY>();
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

    /// Whether what it promised is there.
    pub(crate) fn is_whole(&self) -> bool {
        self.promised as usize == self.pictures.len() && (self.has_index || self.index_at == 0)
    }
}

/// The library's other properties.
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
