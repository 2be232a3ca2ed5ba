//! Bytes on the wire, in both directions.

use plumb_adversary::frames::Decoder;
use plumb_protocol::frame::{Accumulator, FrameError, MAX_MESSAGE, encode, read};
use plumb_protocol::message::{Command, FromBoard, PositionCommand, ToBoard};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "frames",
    input: "bytes on the wire, in pieces of any size",
    run,
    max_length: 600,
    smoke: 50_000,
    words: &["\0"],
};

/// Decodes the input in pieces as long as its first byte says, and compares the result with that of
/// the reference decoder. Parses each message, and the input itself, as a message of each
/// direction.
pub fn run(input: &[u8]) {
    let Some((first, stream)) = input.split_first() else { return };
    let piece = usize::from(*first).max(1);
    let mut reference = Decoder::default();
    let expected: Vec<_> = stream.iter().filter_map(|byte| reference.push(*byte)).collect();
    let found = decode(stream, piece);
    assert_eq!(found, expected, "the decoder differs from the reference");
    found.iter().flatten().for_each(|message| parse(message));
    parse(&stream[..stream.len().min(MAX_MESSAGE)]);
}

/// Decodes the stream in pieces.
fn decode(stream: &[u8], piece: usize) -> Vec<Result<Vec<u8>, FrameError>> {
    let mut accumulator = Accumulator::new();
    let mut found = Vec::new();
    for mut piece in stream.chunks(piece) {
        while !piece.is_empty() {
            found.extend(accumulator.take(&mut piece).map(|message| message.map(<[u8]>::to_vec)));
        }
    }
    found
}

/// Parses a message. What is read is encoded and read again.
fn parse(bytes: &[u8]) {
    let command = read::<ToBoard>(bytes).ok();
    let position = command.and_then(|message| match message.command {
        Command::Position(position) => Some(PositionCommand { id: message.id, position }),
        _ => None,
    });
    assert_eq!(ToBoard::position(bytes), position, "the parser of positions differs");
    if let Some(message) = command {
        assert!(encode(&message).is_ok(), "{message:?} does not fit a frame");
    }
    if let Ok(message) = read::<FromBoard>(bytes) {
        assert!(encode(&message).is_ok(), "{message:?} does not fit a frame");
    }
}
