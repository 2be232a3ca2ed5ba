//! The networks compute what the scripts that trained them compute.

use super::map::{CHANNELS, COLOURS};
use super::*;

/// Returns the input of `pattern` in scripts/detector/export.py.
fn pattern(rows: usize, columns: usize) -> Map {
    let mut map = Map::unset(rows, columns, 0, CHANNELS);
    let pixels = map.channels_mut::<CHANNELS>().into_iter().flatten();
    for (i, value) in pixels.enumerate() {
        *value = (i * 37 % 101) as f32 / 50.0 - 1.0;
    }
    map
}

/// Checks that two lists of numbers are alike, but for rounding.
fn assert_alike(found: &[f32], expected: &[f32]) {
    let alike = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3 * (1.0 + b.abs()));
    assert!(alike && found.len() == expected.len(), "{found:?} {expected:?}");
}

#[test]
fn the_weights_file_is_the_one_that_the_book_has_figures_of() {
    // FNV-1a of 64 bits.
    let hash = FILE.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    let text = String::from_utf8_lossy(&FILE[..80]);
    assert!(text.contains("12184 + 26372 + 82564 "), "{text}");
    assert_eq!(hash, HASH, "new weights: measure docs/understand/detector.md anew, then set this");
}

#[test]
fn the_networks_give_what_torch_gives() {
    let head = Networks::get().proposer.apply(&pattern(16, 24));
    assert_eq!((head.rows, head.columns), (4, 6));
    let found: Vec<f32> = (0..4).map(|k| head.at(4 * k, 2, 1)).collect();
    assert_alike(&found, &PROPOSED);
    let networks = Networks::get();
    for (network, expected) in [(&networks.screen, &SCREENED), (&networks.judge, &JUDGED)] {
        let judgement = network.apply(&pattern(PATCH, PATCH));
        let (x, y) = judgement.offset;
        let found = [judgement.log_odds, x, y, judgement.growth].map(|value| value as f32);
        assert_alike(&found, expected);
    }
}

#[test]
fn without_depth_its_channels_count_as_zeros() {
    let colours = pattern(PATCH, PATCH);
    let judgements = [false, true].map(|has_depth| {
        // The memory of the next map has numbers in it.
        drop(pattern(PATCH, PATCH));
        let mut map = Map::input(PATCH, PATCH, has_depth);
        let channels = map.channels_mut::<COLOURS>().into_iter().enumerate();
        for (channel, values) in channels {
            for (value, seen) in values.iter_mut().zip(colours.rows_of(channel).flatten()) {
                *value = *seen;
            }
        }
        Networks::get().screen.apply(&map)
    });
    assert_eq!(judgements[0], judgements[1]);
}

#[test]
fn a_mirrored_map_has_its_columns_in_the_opposite_order() {
    let (seen, mut map) = (pattern(2, 3), pattern(2, 3));
    map.mirror();
    for channel in 0..CHANNELS {
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
            assert_eq!(map.at(channel, x, y), seen.at(channel, 2 - x, y));
        }
    }
    map.mirror();
    assert_eq!(map, seen);
}

#[test]
fn a_folded_map_has_the_pixels_of_each_square_in_four_channels() {
    let map = pattern(4, 6);
    for border in [0, 1, 4] {
        let folded = map.folded(border);
        assert_eq!((folded.rows, folded.columns), (2, 3));
        for channel in 0..4 * CHANNELS {
            let (dx, dy) = (channel % 2, channel / 2 % 2);
            for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
                let pixel = map.at(channel / 4, 2 * x + dx, 2 * y + dy);
                assert_eq!(folded.at(channel, x, y), pixel, "channel {channel}, {x}, {y}");
            }
        }
    }
}

/// Hash of the weights file.
const HASH: u64 = 0x3832_fe7e_2be2_47c9;
/// Output of scripts/detector/export.py.
const PROPOSED: [f32; 4] = [-4.379_866_6, -0.598_842_5, 0.685_839_2, -0.759_301_2];
const SCREENED: [f32; 4] = [-10.358_679, -0.025_569_2, -0.171_819_3, -0.145_31];
const JUDGED: [f32; 4] = [-6.515_716_6, 0.024_222_8, 0.010_069_6, -0.124_775_9];
