//! Services of the type `std_srvs/Trigger`, for clients of both ways in which ROS 2 maps services
//! to DDS.
//!
//! Fast DDS sends the identity of a request beside the message ("enhanced mapping" of the standard
//! RPC over DDS). Cyclone DDS sends it as the first 16 bytes of the message. A server cannot know
//! which clients come, and a stop must work for each, so the length of a request tells the mapping,
//! and the answer has the same one.

use std::time::Instant;
use std::{fmt, io};

use plumb_frame::source::BoxedError;
use ros2_client::{MessageInfo, RmwRequestId, Subscription};
use rustdds::mio1::{Interest, Registry, Token};
use rustdds::no_key::DataWriterCdr;
use rustdds::rpc::SampleIdentity;
use rustdds::{QosPolicies, SequenceNumber, Timestamp, TopicKind, WriteOptionsBuilder};
use serde::de::{SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::Ros2Error;
use crate::network::Member;
use crate::qos;
use crate::topic::arrival;

/// Bytes of the identity that Cyclone DDS puts before a request and its answer.
const CYCLONE_HEADER: usize = 16;

/// Number of requests that cannot be read before the others get their turn.
const MAX_BROKEN: usize = 100;

/// Name of the type in DDS, without its end.
const TYPE: &str = "std_srvs::srv::dds_::Trigger";

/// Request of `std_srvs/Trigger`, which has no content.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Request {
    /// Identity of the request in the mapping of Cyclone DDS.
    header: Option<[u8; CYCLONE_HEADER]>,
}

impl<'de> Deserialize<'de> for Request {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(CYCLONE_HEADER + 1, RequestVisitor)
    }
}

/// Reads the bytes of a request until there are no more, which is no error.
struct RequestVisitor;

impl<'de> Visitor<'de> for RequestVisitor {
    type Value = Request;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a request of std_srvs/Trigger")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Request, A::Error> {
        let mut header = [0; CYCLONE_HEADER];
        for place in &mut header {
            match bytes.next_element() {
                Ok(Some(byte)) => *place = byte,
                _ => return Ok(Request { header: None }),
            }
        }
        Ok(Request { header: Some(header) })
    }
}

/// Answer of `std_srvs/Trigger`.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Reply {
    /// Identity of the request in the mapping of Cyclone DDS.
    header: Option<[u8; CYCLONE_HEADER]>,
    success: bool,
    message: String,
}

impl Serialize for Reply {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let header = self.header.as_ref().map_or(&[][..], |header| header);
        let mut tuple = serializer.serialize_tuple(header.len() + 2)?;
        for byte in header {
            tuple.serialize_element(byte)?;
        }
        tuple.serialize_element(&self.success)?;
        tuple.serialize_element(&self.message)?;
        tuple.end()
    }
}

/// Identity of a request, for its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ticket {
    header: Option<[u8; CYCLONE_HEADER]>,
    identity: RmwRequestId,
    /// When the request arrived.
    pub(crate) arrival: Instant,
}

impl Ticket {
    fn new(request: &Request, info: &MessageInfo) -> Self {
        let sent = RmwRequestId {
            writer_gid: info.publisher_gid(),
            sequence_number: info.sequence_number(),
        };
        let mut identity = info.related_request_id().unwrap_or(sent);
        if identity.sequence_number == i64::from(SequenceNumber::UNKNOWN) {
            identity.sequence_number = sent.sequence_number;
        }
        Self { header: request.header, identity, arrival: arrival(info) }
    }
}

/// Server of one service.
pub(crate) struct Service {
    requests: Subscription<Request>,
    replies: DataWriterCdr<Reply>,
}

impl Service {
    /// Creates the service `name`, with its namespace.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where it cannot be created.
    pub(crate) fn new(member: &mut Member, name: &str) -> Result<Self, Ros2Error> {
        Self::create(member, name).map_err(Ros2Error::of_endpoint(name))
    }

    fn create(member: &mut Member, name: &str) -> Result<Self, BoxedError> {
        let participant = &member.participant;
        let qos = QosPolicies::from(qos::EVERY_MESSAGE);
        let topic = |prefix: &str, suffix: &str, kind: &str| {
            let (name, kind) = (format!("{prefix}{name}{suffix}"), format!("{TYPE}_{kind}_"));
            participant.create_topic(name, kind, &qos, TopicKind::NoKey)
        };
        let requests = topic("rq", "Request", "Request")?;
        let replies = topic("rr", "Reply", "Response")?;
        let publisher = participant.create_publisher(&qos)?;
        let replies = publisher.create_datawriter_no_key_cdr(&replies, None)?;
        Ok(Self { requests: member.node.create_subscription(&requests, None)?, replies })
    }

    /// Wakes `poll` for each request.
    ///
    /// # Errors
    /// Where the operating system refuses.
    pub(crate) fn register(&mut self, registry: &Registry, token: Token) -> io::Result<()> {
        registry.register(&mut self.requests, token, Interest::READABLE)
    }

    /// Removes and returns the next request; `None` where there is none.
    pub(crate) fn next_request(&self) -> Option<Ticket> {
        for _ in 0..MAX_BROKEN {
            // What cannot be read must not delay the requests behind it.
            let Ok(taken) = self.requests.take() else { continue };
            return taken.map(|(request, info)| Ticket::new(&request, &info));
        }
        None
    }

    /// Answers a request. A client that has vanished gets no answer.
    pub(crate) fn answer(&self, ticket: Ticket, success: bool, message: &str) {
        let reply = Reply { header: ticket.header, success, message: message.to_owned() };
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(SampleIdentity::from(ticket.identity))
            .build();
        let _vanished = self.replies.write_with_options(reply, options);
    }
}

#[cfg(test)]
mod tests {
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::{deserialize_from_cdr_with_rep_id, to_vec};

    use super::*;

    fn request(bytes: &[u8]) -> Request {
        deserialize_from_cdr_with_rep_id(bytes, RepresentationIdentifier::CDR_LE).unwrap().0
    }

    #[test]
    fn the_length_of_a_request_tells_its_mapping() {
        // Trigger's request has no content, for which DDS sends one byte, padded by some to four.
        for bytes in [&[][..], &[0], &[0, 0, 0, 0]] {
            assert_eq!(request(bytes), Request { header: None });
        }
        let header: [u8; 16] = std::array::from_fn(|k| k as u8);
        for rest in [&[0][..], &[0, 0, 0, 0]] {
            assert_eq!(request(&[&header[..], rest].concat()), Request { header: Some(header) });
        }
    }

    #[test]
    fn an_answer_has_the_mapping_of_its_request() {
        let bytes = |header| {
            let reply = Reply { header, success: true, message: "ok".to_owned() };
            to_vec::<_, byteorder::LittleEndian>(&reply).unwrap()
        };
        let plain = [1, 0, 0, 0, 3, 0, 0, 0, b'o', b'k', 0];
        assert_eq!(bytes(None), plain);
        assert_eq!(bytes(Some([9; 16])), [&[9; 16][..], &plain].concat());
    }
}
