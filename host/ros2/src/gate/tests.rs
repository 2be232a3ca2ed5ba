//! Tests of the guard: numbers of RTPS 2.5, and the bounds of the guard.

mod forged;

use std::time::{Duration, Instant};

use super::guard::{Guard, MAX_PARTICIPANTS, Refusal};
use forged::{EVERY_READER, Fragment, PARTICIPANT_READER, PARTICIPANTS, PUBLISHERS, WRITER};

const MEGABYTE: u32 = 1 << 20;

/// A guard that knows participant 1, and the present.
fn guard() -> (Guard, Instant) {
    let (mut guard, now) = (Guard::new(MEGABYTE), Instant::now());
    assert_eq!(guard.admit(&forged::announcement(1, 1, 20), now), Ok(()));
    (guard, now)
}

/// The fragment `first` of a sample that has two.
fn half(number: u32, first: u32) -> Fragment {
    let (reader, size, sample) = (EVERY_READER, 32768, 65536);
    Fragment { reader, writer: WRITER, number, first, size, sample }
}

/// Parameters with the identity of a participant, or of something that it has.
fn identity(name: u16, participant: u32) -> Vec<u8> {
    let guid = [&forged::prefix(participant)[..], &[0, 0, 1, 0xc1]].concat();
    forged::parameters(&[(name, guid)])
}

#[test]
fn participants_have_a_limit_and_make_room_when_they_leave_or_fall_silent() {
    let (mut guard, now) = guard();
    let last = MAX_PARTICIPANTS as u32;
    for k in 2..=last {
        assert_eq!(guard.admit(&forged::announcement(k, k, 1000), now), Ok(()), "{k}");
    }
    let next = |k: u32| forged::announcement(k, k, 1000);
    assert_eq!(guard.admit(&next(last + 1), now), Err(Refusal::Participants));
    // The others go on.
    assert_eq!(guard.admit(&next(last), now), Ok(()));
    // The lease of the first, 20 s, has ended.
    let later = now + Duration::from_secs(31);
    assert_eq!(guard.admit(&next(last + 1), later), Ok(()));
    assert_eq!(guard.admit(&next(last + 2), later), Err(Refusal::Participants));
    let end = forged::data(EVERY_READER, PARTICIPANTS, false, &identity(0x50, 2));
    assert_eq!(guard.admit(&forged::packet(2, &[end]), later), Ok(()));
    assert_eq!(guard.admit(&next(last + 2), later), Ok(()));
}

#[test]
fn nobody_speaks_for_another_or_unannounced() {
    let (mut guard, now) = guard();
    assert_eq!(guard.admit(&forged::announcement(1, 2, 20), now), Err(Refusal::Foreign));
    let end = forged::data(EVERY_READER, PARTICIPANTS, false, &identity(0x50, 2));
    assert_eq!(guard.admit(&forged::packet(1, &[end]), now), Err(Refusal::Foreign));
    let publisher = |k| forged::data(EVERY_READER, PUBLISHERS, true, &identity(0x5a, k));
    assert_eq!(guard.admit(&forged::packet(1, &[publisher(2)]), now), Err(Refusal::Foreign));
    assert_eq!(guard.admit(&forged::packet(1, &[publisher(1)]), now), Ok(()));
    assert_eq!(guard.admit(&forged::packet(3, &[]), now), Err(Refusal::Unannounced));
    assert_eq!(
        guard.admit(&forged::packet(1, &[(0x0c, 0, vec![0; 20])]), now),
        Err(Refusal::Foreign)
    );
    assert_eq!(guard.admit(b"RTPS", now), Err(Refusal::Damaged));
}

#[test]
fn announcements_have_a_limit_and_a_repetition_is_none() {
    let (mut guard, now) = guard();
    let publisher = |k: u32| {
        let guid = [&forged::prefix(1)[..], &k.to_be_bytes()].concat();
        let payload = forged::parameters(&[(0x5a, guid)]);
        forged::packet(1, &[forged::data(EVERY_READER, PUBLISHERS, true, &payload)])
    };
    for k in (0..8192).flat_map(|k| [k, k]) {
        assert_eq!(guard.admit(&publisher(k), now), Ok(()), "{k}");
    }
    assert_eq!(guard.admit(&publisher(8192), now), Err(Refusal::Announcements));
    assert_eq!(guard.admit(&publisher(8191), now), Ok(()));
}

#[test]
fn a_sample_that_is_too_long_or_in_wrong_pieces_is_refused() {
    let (mut guard, now) = guard();
    let mut judge = |it| guard.admit(&forged::fragment(1, it), now);
    let whole = Fragment { sample: MEGABYTE, ..half(1, 1) };
    assert_eq!(judge(whole), Ok(()));
    assert_eq!(judge(Fragment { sample: MEGABYTE + 1, ..half(2, 1) }), Err(Refusal::Sample));
    assert_eq!(judge(Fragment { size: 255, ..half(2, 1) }), Err(Refusal::Sample));
    assert_eq!(judge(Fragment { size: 0, ..half(2, 1) }), Err(Refusal::Sample));
    // A writer has one size.
    assert_eq!(judge(Fragment { size: 16384, ..half(2, 1) }), Err(Refusal::Sample));
    assert_eq!(judge(half(2, 0)), Err(Refusal::Damaged));
    assert_eq!(judge(half(2, 3)), Err(Refusal::Damaged));
    // A sample has one length.
    assert_eq!(judge(half(1, 1)), Err(Refusal::Damaged));
    let writer = PUBLISHERS;
    assert_eq!(judge(Fragment { writer, sample: 65537, ..half(3, 1) }), Err(Refusal::Sample));
    // No participant is announced in pieces.
    assert_eq!(judge(Fragment { writer: PARTICIPANTS, ..half(3, 1) }), Err(Refusal::Damaged));
    let reader = PARTICIPANT_READER;
    assert_eq!(judge(Fragment { reader, writer, ..half(3, 1) }), Err(Refusal::Damaged));
}

#[test]
fn incomplete_samples_have_a_limit_and_complete_ones_have_none() {
    let (mut guard, now) = guard();
    let mut judge = |it, now| guard.admit(&forged::fragment(1, it), now);
    for number in 1..1000 {
        assert_eq!(judge(half(number, 1), now), Ok(()), "{number}");
        // Twice is not both.
        assert_eq!(judge(half(number, 1), now), Ok(()), "{number}");
        assert_eq!(judge(half(number, 2), now), Ok(()), "{number}");
        assert_eq!(judge(half(number, 1), now), Err(Refusal::Repeated), "{number}");
    }
    let taken = (1000..2000).take_while(|number| judge(half(*number, 1), now).is_ok()).count();
    // Two megabytes, with 4096 bytes beside each.
    assert_eq!(taken, 30);
    assert_eq!(judge(half(1000, 2), now), Ok(()));
    assert_eq!(judge(half(2000, 1), now), Ok(()));
    assert_eq!(judge(half(2001, 1), now), Err(Refusal::Incomplete));
    // The DDS library drops them after 10 s.
    assert_eq!(judge(half(2001, 1), now + Duration::from_secs(13)), Ok(()));
}

#[test]
fn long_ranges_are_refused() {
    let (mut guard, now) = guard();
    let mut judge = |kind, ends| guard.admit(&forged::range(1, kind, ends), now);
    for kind in [7, 8] {
        assert_eq!(judge(kind, [9, 65545]), Ok(()));
        assert_eq!(judge(kind, [9, 65546]), Err(Refusal::Range));
        assert_eq!(judge(kind, [10, 9]), Ok(()));
        assert_eq!(judge(kind, [9, 1 << 47]), Err(Refusal::Damaged));
        assert_eq!(judge(kind, [-1, 9]), Err(Refusal::Damaged));
    }
    assert_eq!(judge(7, [1, 65538]), Err(Refusal::Range));
    // One from the beginning on.
    assert_eq!(judge(8, [1, 1 << 40]), Ok(()));
    for (first, judgement) in
        [(0, Err(Refusal::Range)), (1, Ok(())), (65536, Ok(())), (65537, Err(Refusal::Range))]
    {
        let body = [&WRITER[..], &WRITER, &forged::number(1), &u32::to_le_bytes(first)].concat();
        assert_eq!(guard.admit(&forged::packet(1, &[(0x12, 0, body)]), now), judgement);
    }
}
