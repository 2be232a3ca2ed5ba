//! Tests of framing: a stream may start inside a frame and may be damaged.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails at the first unexpected value")]

use crc::{CRC_32_ISO_HDLC, Crc};
use plumb_protocol::frame::{Accumulator, FrameError, MAX_FRAME, TooLong, encode, read};
use plumb_protocol::message::{Command, Hello, Position, PositionCommand, ToBoard};
use plumb_protocol::units::{Covariance, Micrometres, Point};
use proptest::prelude::*;

fn messages() -> impl Strategy<Value = ToBoard> {
    let ball = proptest::option::of(any::<[i32; 3]>().prop_map(|p| Point(p.map(Micrometres))));
    let covariance = (any::<[u16; 3]>(), any::<[i16; 3]>())
        .prop_map(|(variances, covariances)| Covariance { variances, covariances });
    let position = (any::<u16>(), any::<u32>(), ball, proptest::option::of(covariance)).prop_map(
        |(sequence, age_us, ball, covariance)| {
            Command::Position(Position { sequence, age_us, ball, covariance })
        },
    );
    let target = any::<[i32; 3]>().prop_map(|p| Command::Target(Point(p.map(Micrometres))));
    let command = prop_oneof![
        position,
        target,
        Just(Command::Stop),
        Just(Command::Status),
        Just(Command::Hello(Hello::OURS))
    ];
    (any::<u16>(), command).prop_map(|(id, command)| ToBoard { id, command })
}

fn receive(bytes: &[u8]) -> Vec<Result<ToBoard, FrameError>> {
    let mut accumulator = Accumulator::new();
    bytes.iter().filter_map(|&b| accumulator.push(b)).collect()
}

proptest! {
    #[test]
    fn sent_messages_arrive(sent in proptest::collection::vec(messages(), 1..8)) {
        let bytes: Vec<u8> = sent.iter().flat_map(|m| encode(m).unwrap()).collect();
        let received: Vec<_> = receive(&bytes).into_iter().map(Result::unwrap).collect();
        prop_assert_eq!(received, sent);
    }

    /// Checks `take` with pieces of any size, and `ToBoard::position` with every command.
    #[test]
    fn positions_are_decoded_in_pieces_of_any_size(
        sent in proptest::collection::vec(messages(), 1..8),
        piece in 1usize..70,
    ) {
        let bytes: Vec<u8> = sent.iter().flat_map(|m| encode(m).unwrap()).collect();
        let mut accumulator = Accumulator::new();
        let mut received = Vec::new();
        for mut piece in bytes.chunks(piece) {
            while !piece.is_empty() {
                let Some(message) = accumulator.take(&mut piece) else { continue };
                let message = message.unwrap();
                let whole = read::<ToBoard>(message).unwrap();
                let expected = match whole.command {
                    Command::Position(position) => {
                        Some(PositionCommand { id: whole.id, position })
                    }
                    _ => None,
                };
                prop_assert_eq!(ToBoard::position(message), expected);
                received.push(whole);
            }
        }
        prop_assert_eq!(received, sent);
    }

    #[test]
    fn a_frame_ends_with_its_only_zero(message in messages()) {
        let frame = encode(&message).unwrap();
        prop_assert!(frame.len() <= MAX_FRAME);
        prop_assert_eq!(frame.iter().position(|&b| b == 0), Some(frame.len() - 1));
    }

    /// Changes one byte: the frame is lost or split but never decoded as another message, and the
    /// next frame arrives.
    #[test]
    fn a_damaged_frame_is_dropped_and_the_next_arrives(
        first in messages(), second in messages(), at in any::<prop::sample::Index>(), flip in 1u8..
    ) {
        let mut bytes = encode(&first).unwrap().to_vec();
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        bytes.extend(encode(&second).unwrap());
        let good: Vec<_> = receive(&bytes).into_iter().filter_map(Result::ok).collect();
        // Without the closing zero of the first frame, both frames are one damaged frame.
        let expected = if at == encode(&first).unwrap().len() - 1 { vec![] } else { vec![second] };
        prop_assert_eq!(good, expected);
    }

    /// Cuts a frame anywhere. The stream continues with a zero and a complete frame.
    #[test]
    fn a_torn_frame_does_not_affect_the_next(
        first in messages(), second in messages(), keep in any::<prop::sample::Index>()
    ) {
        let frame = encode(&first).unwrap();
        let keep = keep.index(frame.len() - 1);
        let mut bytes = frame[..keep].to_vec();
        bytes.push(0);
        bytes.extend(encode(&second).unwrap());
        let received = receive(&bytes);
        prop_assert_eq!(received.last(), Some(&Ok(second)));
        prop_assert!(received[..received.len() - 1].iter().all(Result::is_err));
    }

    #[test]
    fn noise_is_never_decoded_as_a_message(
        noise in proptest::collection::vec(any::<u8>(), 0..600), message in messages()
    ) {
        let mut bytes = noise;
        bytes.push(0);
        let before = receive(&bytes);
        prop_assert!(before.iter().all(Result::is_err));
        bytes.extend(encode(&message).unwrap());
        let after = receive(&bytes);
        prop_assert_eq!(after.last(), Some(&Ok(message)));
    }
}

#[test]
fn each_damage_has_its_error() {
    let frame = encode(&ToBoard { id: 1, command: Command::Status }).unwrap();
    let overlong: Vec<u8> = std::iter::repeat_n(1, MAX_FRAME + 1).chain([0]).collect();
    assert_eq!(receive(&overlong), [Err(FrameError::Overlong)]);
    assert_eq!(receive(&[9, 1, 0]), [Err(FrameError::Torn)]);
    let mut wrong = frame.to_vec();
    let last = wrong.len() - 2;
    wrong[last] ^= 0x40;
    assert_eq!(receive(&wrong), [Err(FrameError::Crc)]);
    // Intact frames of a newer protocol: an unknown command, and a known one with trailing bytes.
    assert_eq!(receive(&encode(&(1u16, 200u8)).unwrap()), [Err(FrameError::Malformed)]);
    assert_eq!(receive(&encode(&(1u16, 9u8, 0u8)).unwrap()), [Err(FrameError::Malformed)]);
    assert_eq!(receive(&[0, 0, 0]), []);
}

/// Returns the frame with `message`, which has more than 253 bytes with its CRC and no zero, so
/// that COBS begins with its longest run.
fn frame_of_a_long_run(message: &[u8]) -> Vec<u8> {
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(message).to_le_bytes();
    let plain = [message, &crc].concat();
    assert!(!plain.contains(&0));
    let (run, rest) = plain.split_at(254);
    [&[255], run, &[1 + rest.len() as u8], rest, &[0]].concat()
}

/// No message of this crate is as long. A decoder that keeps to COBS reads it nevertheless.
#[test]
fn the_longest_run_has_no_zero_behind_it_and_the_decoder_is_filled_to_its_end() {
    for (length, expected) in [(250, Ok(250)), (251, Ok(251)), (252, Err(FrameError::Overlong))] {
        let message = vec![7; length];
        let frame = frame_of_a_long_run(&message);
        let mut accumulator = Accumulator::new();
        let found = accumulator.take(&mut &frame[..]).unwrap();
        assert_eq!(found.map(<[u8]>::len), expected);
    }
}

#[test]
fn errors_say_what_is_wrong() {
    assert_eq!(TooLong.to_string(), "the message is longer than 248 bytes");
    let texts = [
        (FrameError::Overlong, "an overlong frame"),
        (FrameError::Torn, "a torn frame"),
        (FrameError::Crc, "a corrupted frame (CRC)"),
        (FrameError::Malformed, "an intact frame that is not a message of this version"),
    ];
    for (error, text) in texts {
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn overlong_messages_are_refused() {
    // The length prefix has one byte below 128 entries, and two from 128 on.
    let bytes = [7u8; 300];
    assert!(encode(&&bytes[..246]).is_ok_and(|frame| frame.len() <= MAX_FRAME));
    assert_eq!(encode(&&bytes[..247]), Err(TooLong));
}

#[test]
fn a_covariance_is_rounded_and_limited_to_its_range() {
    let of = |m: [[f64; 3]; 3]| Covariance::from_metres2(m);
    let seen = of([[4e-6, -2.96e-8, 0.0], [9.0; 3], [9.0, 9.0, 1e-6]]).unwrap();
    assert_eq!(
        seen,
        Covariance { variances: [400, u16::MAX, 100], covariances: [-3, 0, i16::MAX] }
    );
    assert_eq!(of([[0.0; 3]; 3]).unwrap().variances, [1; 3]);
    for wrong in [f64::NAN, f64::INFINITY, -1e-6] {
        assert_eq!(of([[1e-6, 0.0, 0.0], [0.0, wrong, 0.0], [0.0, 0.0, 1e-6]]), None);
    }
}
