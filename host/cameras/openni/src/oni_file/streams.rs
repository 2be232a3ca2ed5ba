//! Check of the order of the records of all streams.

use std::collections::BTreeMap;

use super::node::Node;
use super::record::{
    DATA_BEGINS, END, Fields, GENERAL, INDEX, NEW_DATA, NODE_ADDED, NODE_REMOVED, NUMBER, READY,
    REAL, Record, TEXT,
};

/// Most streams of a file: colour, depth, infrared, and some of other kinds.
pub(super) const MAX_STREAMS: u32 = 8;

/// Streams of a file, as far as its records have been read.
#[derive(Default)]
pub(super) struct Streams {
    nodes: BTreeMap<u32, Node>,
    /// Positions of the records.
    starts: Vec<u64>,
    /// Pictures of all streams.
    pub(super) pictures: u32,
}

impl Streams {
    /// Returns the number of records so far.
    pub(super) fn record_count(&self) -> usize {
        self.starts.len()
    }

    /// Adds the next record with its fields.
    ///
    /// # Errors
    /// Where the record is invalid: what is wrong with it.
    pub(super) fn add(&mut self, record: &Record, fields: &[u8]) -> Result<(), &'static str> {
        let has_payload = matches!(record.kind, NEW_DATA | INDEX);
        if !has_payload && record.payload != 0 {
            return Err("a record has data that has none");
        }
        if record.undone != 0 && self.starts.binary_search(&record.undone).is_err() {
            return Err("a record undoes one that is not there");
        }
        self.starts.push(record.at);
        match record.kind {
            NODE_ADDED => self.add_stream(record, fields),
            END => {
                let is_complete = self.nodes.values().all(Node::is_complete) && fields.is_empty();
                is_complete
                    .then_some(())
                    .ok_or("pictures or an index that are promised are not there")
            }
            _ => self.add_to_stream(record, fields),
        }
    }

    /// Adds a stream.
    fn add_stream(&mut self, record: &Record, fields: &[u8]) -> Result<(), &'static str> {
        let node = Node::added(Fields(fields)).ok_or("a stream is of no kind that is known")?;
        let is_new = (1..=MAX_STREAMS).contains(&record.node)
            && self.nodes.insert(record.node, node).is_none();
        is_new.then_some(()).ok_or("a stream has the number of another")
    }

    /// Adds a record of a stream.
    fn add_to_stream(&mut self, record: &Record, fields: &[u8]) -> Result<(), &'static str> {
        let node =
            self.nodes.get_mut(&record.node).ok_or("a record is of a stream that is not there")?;
        let is_valid = match record.kind {
            NUMBER | REAL | TEXT | GENERAL => {
                return node
                    .property(Fields(fields), matches!(record.kind, NUMBER | REAL))
                    .ok_or("a property is not what it can be");
            }
            DATA_BEGINS => fields.len() == 12 && node.is_ready(),
            READY => fields.is_empty() && node.is_ready(),
            NODE_REMOVED => fields.is_empty(),
            NEW_DATA => {
                self.pictures += 1;
                return node
                    .picture(Fields(fields), record.payload, record.at)
                    .ok_or("a picture is out of order or of a size that it cannot have");
            }
            INDEX => {
                return node
                    .index(fields, record.at)
                    .ok_or("the index is not that of the pictures");
            }
            _ => return Err("there is a record of no kind that is known"),
        };
        is_valid.then_some(()).ok_or("a stream's pictures cannot begin or end here")
    }
}
