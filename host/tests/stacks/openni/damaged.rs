//! Damaged recordings of a camera.

use std::fs;

use super::fixture::{Emulator, Fixture, rows, stderr, stdout};

#[test]
fn a_truncated_recording_is_an_error() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let (path, whole) = fixture.record();
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let output = fixture.plumb(&["replay", "recording/recording.oni"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recording.oni") && stderr(&output).contains("truncated"),
        "{}",
        stderr(&output)
    );
}

/// A file with bytes changed anywhere, or cut, gives rows or an error, never a crash of the program
/// or of the library in it.
#[test]
fn damaged_recordings_give_rows_or_an_error() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    let (path, whole) = fixture.record();
    let sound = rows(&stdout(&fixture.plumb(&["replay", "recording/recording.oni"])));
    assert!(!sound.is_empty());
    // Most of the file is pictures. The bytes before and behind them are changed as often.
    let (head, tail) = (2000.min(whole.len()), whole.len().saturating_sub(1200));
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    let mut below = |n: usize| {
        // xorshift64
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % n as u64) as usize
    };
    let mut refused = 0;
    for case in 0..32 {
        let mut bytes = whole.clone();
        if case % 8 == 7 {
            bytes.truncate(below(whole.len()));
        }
        for _ in 0..[1, 3, 12][case % 3] {
            let at = match below(3) {
                0 => below(head),
                1 => tail + below(whole.len() - tail),
                _ => below(whole.len()),
            };
            let value = below(256) as u8;
            bytes.get_mut(at).into_iter().for_each(|byte| *byte = value);
        }
        fs::write(&path, bytes).unwrap();
        let output = fixture.plumb(&["replay", "recording/recording.oni"]);
        // A crash has no exit code.
        match output.status.code() {
            Some(0) => assert_eq!(rows(&stdout(&output)).len(), sound.len(), "case {case}"),
            // A damaged picture: its frame is lost and reported, the others are replayed.
            Some(1) => {
                refused += 1;
                let text = stderr(&output);
                let is_reported = text.contains(" broken") && !text.contains(" 0 broken");
                assert!(is_reported, "case {case}: {text}");
            }
            Some(2) => {
                refused += 1;
                let text = stderr(&output);
                assert!(text.contains("recording.oni"), "case {case}: {text}");
            }
            code => panic!("case {case}: {code:?}: {}", stderr(&output)),
        }
    }
    assert!(refused >= 16, "{refused} of 32");
}
