//! Bounds on intermediate values of laws, tracker and guards, from the ranges of this module: a
//! wider range fails here before it overflows on the chip.

use super::{
    MAX_BOUND, MAX_COORDINATE_UM, MAX_GAIN, MAX_MARGIN_UM, MAX_PATH_SPEED, MAX_REACHED_RADIUS_UM,
    MAX_SIGN_GAIN, MAX_TRAVEL,
};
use crate::law::{INTERVAL_ERROR, LIMB_BITS};

const I32: i128 = i32::MAX as i128;
const U32: i128 = u32::MAX as i128;
const I64: i128 = i64::MAX as i128;

/// Largest difference of two coordinates, µm.
const ERROR: i128 = 2 * MAX_COORDINATE_UM as i128;

/// Bound on |e|, µm: above √3 times [`ERROR`].
const LENGTH: i128 = 2 * ERROR;

/// Checks that the bound `value` fits a word whose largest value is `largest`.
fn check(value: i128, largest: i128) {
    assert!((0..=largest).contains(&value), "{value} is beyond {largest}");
}

/// The chip does not check these sums: a check takes 64 bits.
#[test]
fn the_sums_of_the_law_interval_fit_their_words() {
    let (error, bound) = (i128::from(INTERVAL_ERROR), i128::from(MAX_BOUND));
    // Two limbs have LIMB_BITS bits. The third has the sign.
    let limb = ((error >> (2 * LIMB_BITS)) + 1).max(1 << LIMB_BITS);
    check(3 * limb * bound, I32);
    check(3 * error * bound, I64);
    // v saturates at 2^27.
    check(i128::from(MAX_GAIN), I32);
    check((1 << 27) * i128::from(MAX_GAIN), I64);
}

#[test]
fn the_products_of_the_law_sign_fit_their_words() {
    // The boost doubles the gain at most. A component of the direction is up to four errors of 22
    // bits.
    let gain = 2 * i128::from(MAX_SIGN_GAIN);
    check(gain, I32);
    check(gain * (4 << 22), I64);
}

#[test]
fn errors_and_their_squares_fit_their_words() {
    check(ERROR, I32);
    check(3 * ERROR * ERROR, I64);
    // `ArrivalDetector`: the filter's residual and its velocity are below 5 |e|, for positions of
    // any signs; in units of 1/16 µm. So is the mean of the residuals; distances from it, and sums
    // with it, are below 10 |e|.
    check(10 * 16 * ERROR, I32);
    check(100 * 3 * 100 * ERROR * ERROR, I64);
    let radius = i128::from(MAX_REACHED_RADIUS_UM);
    check(100 * 25 * radius * radius, I64);
    // Near the target the distance is within 0.88 of the radius. So is the way in 0.17 s, or the
    // test ends before the sum.
    let limit = 77 * radius * radius;
    check(255 * 2 * limit + 100 * 16 * radius * radius, I64);
    // Guards add a margin to |e|.
    check(LENGTH + i128::from(MAX_MARGIN_UM), U32);
}

/// `RunOuts`: the way to a target, or to where a reference is a second later, and the turn of a
/// motor; scalar products of three.
#[test]
fn run_outs_fit_their_words() {
    let second = i128::from(MAX_PATH_SPEED);
    check(ERROR + 2 * second, I32);
    check(3 * ERROR * (ERROR + 2 * second), I64);
    let turn = 2 * i128::from(MAX_TRAVEL);
    check(3 * (turn / 4 + 1) * 2 * turn, I64);
}

/// The filter has 4 fraction bits.
#[test]
fn the_tracker_fits_its_words() {
    check((ERROR << 4) + 8, I32);
}

/// A guard compares the difference of two positions, which has no sign.
#[test]
fn the_turn_of_a_motor_fits_its_word() {
    check(2 * i128::from(MAX_TRAVEL), U32);
}
