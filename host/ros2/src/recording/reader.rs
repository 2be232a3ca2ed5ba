//! Records of an MCAP file, one after the other.

use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::parse_record;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::chunk::Chunk;
use super::error::McapError;

/// Longest record and chunk that is read, bytes: a raw colour picture of 8192 x 8192, and a
/// reserve.
const LONGEST_RECORD: usize = 1 << 28;

/// Least number of bytes that are read from the file at once.
const LEAST_READ: usize = 1 << 16;

/// Most bytes that are read from the file at once: a damaged length asks for no more memory than
/// the file has bytes.
const MOST_READ: usize = 1 << 22;

/// Topic of a file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Channel {
    /// Name.
    pub(super) topic: String,
    /// Name of the type, such as `sensor_msgs/msg/Image`.
    pub(super) schema: String,
    /// Encoding of the messages, such as `cdr`.
    pub(super) encoding: String,
}

/// Message of a file.
pub(super) struct Message {
    /// Its topic.
    pub(super) channel: Arc<Channel>,
    /// Its bytes.
    pub(super) data: Vec<u8>,
}

/// Reader of an MCAP file from its start.
pub(super) struct Reader {
    path: PathBuf,
    file: File,
    linear: LinearReader,
    /// Chunk whose records come next.
    chunk: Chunk,
    known: Known,
}

/// Schemas and channels that the file has named so far, by their numbers.
#[derive(Debug, Default)]
struct Known {
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, Arc<Channel>>,
}

/// What a record is to the reader.
enum Item {
    Message(Message),
    /// A topic that was not known before.
    Channel(Arc<Channel>),
}

impl Reader {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub(super) fn open(path: &Path) -> Result<Self, McapError> {
        let file = File::open(path).map_err(|error| unreadable(path, error))?;
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(LONGEST_RECORD);
        let linear = LinearReader::new_with_options(options);
        let (path, chunk, known) = (path.to_owned(), Chunk::default(), Known::default());
        Ok(Self { path, file, linear, chunk, known })
    }

    /// Returns the next message on a topic that `wanted` accepts; `None` at the end.
    ///
    /// # Errors
    /// Where the file cannot be read, or is damaged: nothing more comes then.
    pub(super) fn next(
        &mut self,
        wanted: impl Fn(&Channel) -> bool,
    ) -> Result<Option<Message>, McapError> {
        while let Some(item) = self.item(&wanted)? {
            if let Item::Message(message) = item {
                return Ok(Some(message));
            }
        }
        Ok(None)
    }

    /// Returns the topics of the whole file, in the order of their names.
    ///
    /// # Errors
    /// As [`next`](Self::next); a damaged file has the topics before the damage.
    pub(super) fn topics(mut self) -> Result<Vec<Arc<Channel>>, McapError> {
        let mut topics = BTreeSet::new();
        loop {
            match self.item(|_| false) {
                Ok(Some(Item::Channel(channel))) => _ = topics.insert(channel),
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(error) if topics.is_empty() => return Err(error),
                Err(_) => break,
            }
        }
        Ok(topics.into_iter().collect())
    }

    /// Returns the next topic, or message on a topic that `wanted` accepts; `None` at the end.
    fn item(&mut self, wanted: impl Fn(&Channel) -> bool) -> Result<Option<Item>, McapError> {
        let damaged = |error| damaged(&self.path, error);
        loop {
            if let Some((opcode, data)) = self.chunk.next().map_err(damaged)? {
                let record = parse_record(opcode, data).map_err(damaged)?;
                if let Some(item) = self.known.item(record, &wanted) {
                    return Ok(Some(item));
                }
                continue;
            }
            let Some(event) = self.linear.next_event() else { return Ok(None) };
            let (opcode, data) = match event.map_err(damaged)? {
                LinearReadEvent::Record { opcode, data } => (opcode, data),
                LinearReadEvent::ReadRequest(length) => {
                    let buffer = self.linear.insert(length.clamp(LEAST_READ, MOST_READ));
                    let read = self.file.read(buffer);
                    let read = read.map_err(|error| unreadable(&self.path, error))?;
                    self.linear.notify_read(read);
                    continue;
                }
            };
            match parse_record(opcode, data).map_err(damaged)? {
                Record::Chunk { header, data } => {
                    self.chunk = Chunk::unpack(&header, &data, LONGEST_RECORD).map_err(damaged)?;
                }
                record => {
                    if let Some(item) = self.known.item(record, &wanted) {
                        return Ok(Some(item));
                    }
                }
            }
        }
    }
}

impl Known {
    /// Returns a record as an item, and remembers schemas and channels. `None` for a record of
    /// another kind and for a message that is not `wanted`.
    fn item(&mut self, record: Record<'_>, wanted: impl Fn(&Channel) -> bool) -> Option<Item> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
                None
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let (topic, encoding) = (channel.topic, channel.message_encoding);
                let known = Arc::new(Channel { topic, schema, encoding });
                self.channels.insert(channel.id, Arc::clone(&known));
                Some(Item::Channel(known))
            }
            Record::Message { header, data } => {
                let channel = self.channels.get(&header.channel_id);
                let channel = channel.filter(|channel| wanted(channel))?;
                let (channel, data) = (Arc::clone(channel), data.into_owned());
                Some(Item::Message(Message { channel, data }))
            }
            _ => None,
        }
    }
}

fn unreadable(path: &Path, error: std::io::Error) -> McapError {
    McapError::Read { path: path.to_owned(), error }
}

fn damaged(path: &Path, error: mcap::McapError) -> McapError {
    McapError::Damaged { path: path.to_owned(), error }
}
