//! The frame decoder against a simple reference, and the parser of messages with any bytes.

mod reference;

use plumb_protocol::frame::{Accumulator, FrameError, MAX_FRAME, encode, read};
use plumb_protocol::message::*;
use plumb_protocol::units::{Rate, Steps16};

use crate::campaign::Outcome;
use crate::generate;
use crate::random::Random;
pub use reference::{Decoder, decode};

/// The decoder returns the same messages and errors as the reference, for pieces of any size.
pub const REFERENCE: &str = "decodes as the reference";
/// A frame has one zero, at its end, and at most `MAX_FRAME` bytes; decoding returns its message.
pub const ENCODING: &str = "encodes what decodes";
/// An intact frame after a zero is decoded, independent of the bytes before.
pub const RESYNCHRONISES: &str = "resynchronises";
/// The fast parser for positions agrees with the parser for all commands.
pub const POSITIONS: &str = "finds positions";

/// Returns the frame of `message`.
pub fn framed(message: &ToBoard) -> Vec<u8> {
    match encode(message) {
        Ok(frame) => frame.to_vec(),
        Err(error) => unreachable!("every command fits a frame: {error}"),
    }
}

/// Runs the campaign of one seed over `stretches` of a damaged stream.
pub fn run(seed: u64, stretches: u64, outcome: &mut Outcome) {
    let mut random = Random::new(seed);
    let mut accumulator = Accumulator::new();
    for tick in 0..stretches {
        outcome.tick = tick;
        stretch(&mut random, &mut accumulator, outcome);
        parse_any_bytes(&mut random, outcome);
    }
}

/// Checks some frames, most of them damaged, and an intact one at the end.
fn stretch(random: &mut Random, accumulator: &mut Accumulator, outcome: &mut Outcome) {
    let mut stream = Vec::new();
    for _ in 0..1 + random.below(6) {
        let mut frame = framed(&message(random));
        check_encoding(&frame, outcome);
        if random.percent(70) {
            damage(random, &mut frame);
            outcome.tally.count("damaged frames");
        } else {
            outcome.tally.count("intact frames");
        }
        stream.extend(frame);
    }
    let last = message(random);
    stream.push(0);
    stream.extend(framed(&last));
    let found = decode_in_pieces(random, accumulator, &stream);
    compare(&stream, &found, outcome);
    let received =
        found.last().and_then(|found| found.as_ref().ok()).and_then(|bytes| read(bytes).ok());
    outcome.check(received == Some(last), RESYNCHRONISES, || {
        format!("{received:?} instead of {last:?}")
    });
}

fn check_encoding(frame: &[u8], outcome: &mut Outcome) {
    let zero = frame.iter().position(|byte| *byte == 0);
    let shaped = frame.len() <= MAX_FRAME && zero == Some(frame.len() - 1);
    let decodes = decode(&frame[..frame.len() - 1]).is_ok();
    outcome.check(shaped && decodes, ENCODING, || format!("{frame:?}"));
}

fn decode_in_pieces(
    random: &mut Random,
    accumulator: &mut Accumulator,
    mut stream: &[u8],
) -> Vec<Result<Vec<u8>, FrameError>> {
    let mut found = Vec::new();
    while !stream.is_empty() {
        let most = if random.percent(50) { stream.len() } else { stream.len().min(8) };
        let (mut piece, rest) = stream.split_at(1 + random.below(most as u64) as usize);
        stream = rest;
        while !piece.is_empty() {
            found.extend(accumulator.take(&mut piece).map(|message| message.map(<[u8]>::to_vec)));
        }
    }
    found
}

fn compare(stream: &[u8], found: &[Result<Vec<u8>, FrameError>], outcome: &mut Outcome) {
    let mut decoder = Decoder::default();
    let expected: Vec<_> = stream.iter().filter_map(|byte| decoder.push(*byte)).collect();
    for message in &expected {
        outcome.tally.count(match message {
            Ok(_) => "decoded",
            Err(FrameError::Overlong) => "overlong",
            Err(FrameError::Torn) => "torn",
            Err(FrameError::Crc) => "wrong checksum",
            Err(FrameError::Malformed | FrameError::UnknownCommand { .. }) => "malformed",
        });
    }
    let different = expected.iter().zip(found).position(|(expected, found)| expected != found);
    outcome.check(expected.len() == found.len() && different.is_none(), REFERENCE, || {
        let at = different.unwrap_or(expected.len().min(found.len()));
        format!("frame {at}: {:?} instead of {:?}, of {stream:?}", found.get(at), expected.get(at))
    });
}

/// Damages a frame: flipped bits, a byte lost or added, noise inside.
pub fn damage(random: &mut Random, frame: &mut Vec<u8>) {
    let at = random.below(frame.len() as u64) as usize;
    match random.below(4) {
        0 => {
            for _ in 0..1 + random.below(4) {
                let at = random.below(frame.len() as u64) as usize;
                frame[at] ^= 1 << random.below(8);
            }
        }
        1 => {
            frame.remove(at);
        }
        2 => frame.insert(at, random.bits() as u8),
        _ => {
            let length = random.below(600);
            let tail = frame.split_off(at);
            frame.extend(noise(random, length));
            frame.extend(tail);
        }
    }
}

/// Returns `length` bytes, a few of them zero.
pub fn noise(random: &mut Random, length: u64) -> Vec<u8> {
    (0..length).map(|_| if random.percent(3) { 0 } else { random.bits() as u8 }).collect()
}

/// Returns any command with any content.
fn message(random: &mut Random) -> ToBoard {
    let command = match random.below(10) {
        0 => Command::Hello(Hello { version: random.bits() as u16, ..Hello::OURS }),
        1 => Command::Stop,
        2 => Command::Configure(generate::invalid(random, [0; 3]).config),
        7 => Command::Wire(generate::invalid(random, [0; 3]).wiring),
        3 => Command::Target(generate::any_point(random)),
        4 => Command::Jog(Jog {
            motor: random.bits() as u8,
            distance: Steps16(random.any_i32()),
            rate: Rate(random.any_i32()),
        }),
        5 => Command::Status,
        6 => Command::Diagnose,
        8 => {
            let config = generate::typical(random);
            Command::Prior(generate::prior(random, &config))
        }
        _ => Command::Position(Position {
            sequence: random.bits() as u16,
            age_us: random.bits() as u32,
            ball: random.percent(80).then(|| generate::any_point(random)),
            covariance: generate::covariance(random),
        }),
    };
    ToBoard { id: random.bits() as u16, command }
}

/// Parses bytes without a frame around them as every message.
fn parse_any_bytes(random: &mut Random, outcome: &mut Outcome) {
    let bytes = if random.percent(50) { nearly_a_message(random) } else { any_bytes(random) };
    let whole = read::<ToBoard>(&bytes).ok();
    let expected = whole.and_then(|message| match message.command {
        Command::Position(position) => Some(PositionCommand { id: message.id, position }),
        _ => None,
    });
    outcome.tally.add("parsed from any bytes", whole.is_some().into());
    outcome.tally.add("positions parsed from any bytes", expected.is_some().into());
    outcome.tally.add("answers parsed from any bytes", read::<FromBoard>(&bytes).is_ok().into());
    let quick = ToBoard::position(&bytes);
    outcome.check(quick == expected, POSITIONS, || format!("{quick:?} instead of {expected:?}"));
}

/// Returns a message that may have a wrong byte or length.
fn nearly_a_message(random: &mut Random) -> Vec<u8> {
    let frame = framed(&message(random));
    let mut bytes = decode(&frame[..frame.len() - 1]).unwrap_or_default();
    let at = random.below(bytes.len() as u64) as usize;
    match random.below(3) {
        0 => bytes[at] = random.bits() as u8,
        1 => bytes.truncate(at),
        _ => bytes.extend(random.percent(50).then_some(0)),
    }
    bytes
}

/// Returns up to 60 bytes; in half of the cases with small values.
fn any_bytes(random: &mut Random) -> Vec<u8> {
    let mask = if random.percent(50) { 0x0F } else { 0xFF };
    (0..random.below(60)).map(|_| random.bits() as u8 & mask).collect()
}
