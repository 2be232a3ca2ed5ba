//! The soft floats against the host's floats, bit for bit.

use plumb_core::soft_float::{add, divide, equal, less, less_or_equal, multiply, unordered};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Pairs to try of each kind.
const PAIRS: usize = 1_000_000;

/// One number of each class and those at its borders, of positive sign.
const EDGES: [u32; 30] = [
    0, // zero
    1, // the least subnormal
    2,
    3,
    0x0000_8000,
    0x0040_0000,
    0x007f_fffe,
    0x007f_ffff, // the greatest subnormal
    0x0080_0000, // the least normal number
    0x0080_0001,
    0x00ff_ffff,
    0x0100_0000,
    0x0c80_0000, // 2^-102: beside 1, products and quotients of it are at the subnormals
    0x3300_0000, // 2^-25, 2^-24 and 2^-23: half way and a unit beside 1
    0x3380_0000,
    0x3380_0001,
    0x3400_0000,
    0x3f00_0000, // a half
    0x3f7f_ffff,
    0x3f80_0000, // 1
    0x3f80_0001,
    0x3fff_ffff,
    0x4000_0000,
    0x4b7f_ffff, // 2^24 and about it
    0x4b80_0000,
    0x7e80_0000,
    0x7f00_0000,
    0x7f7f_ffff, // the greatest number
    0x7f80_0000, // infinity
    0x7fc0_0000, // NaN
];

/// Divides whole numbers, as the chip's divider does.
fn whole(dividend: u32, divisor: u32) -> (u32, u32) {
    (dividend / divisor, dividend % divisor)
}

/// Checks every function on a pair against the host.
#[track_caller]
fn check(a: u32, b: u32) {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    let alike = |name: &str, ours: u32, host: f32| {
        let same =
            if host.is_nan() { f32::from_bits(ours).is_nan() } else { ours == host.to_bits() };
        assert!(
            same,
            "{name}: {a:#010x}, {b:#010x}: {ours:#010x}, the host {:#010x}",
            host.to_bits()
        );
    };
    alike("add", add(a, b), x + y);
    alike("multiply", multiply(a, b), x * y);
    alike("divide", divide(a, b, whole), x / y);
    let ours = [equal(a, b), less(a, b), less_or_equal(a, b), unordered(a, b)];
    assert_eq!(ours, [x == y, x < y, x <= y, x.is_nan() || y.is_nan()], "{a:#010x}, {b:#010x}");
}

fn check_all(seed: u64, mut pair: impl FnMut(&mut ChaCha8Rng) -> (u32, u32)) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..PAIRS {
        let (a, b) = pair(&mut random);
        check(a, b);
    }
}

/// Returns a number of few significant bits, at an exponent about the middle: results are often
/// half way between two numbers.
fn coarse(random: &mut ChaCha8Rng) -> u32 {
    let kept = random.random_range(1..=23);
    let significand = random.next_u32() >> 9 >> (23 - kept) << (23 - kept);
    random.next_u32() & 1 << 31 | random.random_range(110..145) << 23 | significand
}

#[test]
fn pairs_of_every_class() {
    let signed = || EDGES.into_iter().flat_map(|edge| [edge, edge | 1 << 31]);
    for a in signed() {
        signed().for_each(|b| check(a, b));
    }
}

#[test]
fn pairs_of_an_edge_and_any_number() {
    check_all(1, |random| {
        let edge = EDGES[random.random_range(0..EDGES.len())];
        let (a, b) = (edge ^ random.next_u32() & 1 << 31, random.next_u32());
        if random.random() { (a, b) } else { (b, a) }
    });
}

#[test]
fn pairs_of_any_bits() {
    check_all(2, |random| (random.next_u32(), random.next_u32()));
}

/// Sums of such pairs are rounded and cancel.
#[test]
fn pairs_of_about_one_size() {
    check_all(3, |random| {
        let a = random.next_u32();
        let near = (a >> 23).wrapping_add(random.random_range(0..=54)).wrapping_sub(27) << 23;
        (a, near & !(1 << 31) | random.next_u32() & (1 << 31 | 0x7f_ffff))
    });
    check_all(4, |random| {
        let a = random.next_u32();
        (a, (a ^ 1 << 31).wrapping_add(random.next_u32() >> random.random_range(8..32)))
    });
}

#[test]
fn ties_go_to_even() {
    check_all(5, |random| (coarse(random), coarse(random)));
    // An odd number of halves of a unit: half way by construction.
    check_all(6, |random| {
        let significand = random.next_u32() >> 9;
        let half = 127 + 23 - random.random_range(0..2) - 24;
        ((127 + 23) << 23 | significand, half << 23 | random.next_u32() & 1 << 31)
    });
}

/// Products and quotients of numbers whose exponents make them subnormal, or hardly not; the same
/// at the upper end.
#[test]
fn pairs_at_the_ends_of_the_range() {
    check_all(7, |random| {
        let a = random.next_u32();
        let end = if random.random() { 127 - 12 } else { 127 + 254 };
        let exponent =
            (end - i64::from(a << 1 >> 24) + random.random_range(-30..30)).clamp(0, 255) as u32;
        (a, exponent << 23 | random.next_u32() & (1 << 31 | 0x7f_ffff))
    });
    check_all(8, |random| {
        let a = random.next_u32();
        let end = if random.random() { 127 - 12 } else { -127 };
        let exponent =
            (i64::from(a << 1 >> 24) - end + random.random_range(-30..30)).clamp(0, 255) as u32;
        (a, exponent << 23 | random.next_u32() & (1 << 31 | 0x7f_ffff))
    });
    // Subnormals and their neighbours among themselves.
    check_all(9, |random| {
        let small = |random: &mut ChaCha8Rng| random.next_u32() & (1 << 31 | 0x1ff_ffff);
        (small(random), small(random))
    });
}
