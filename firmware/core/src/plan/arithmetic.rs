//! Bounds on the planner's intermediate values, from the ranges of [`params`](crate::params): a
//! wider range fails here before it overflows on the chip.

use super::moving_average::{CELL_TICKS, CELLS};
use super::pulses::{RATE_BITS, UNIT};
use super::travel_limit::{MAX_SAFE_ZONE_TICKS, SAFE_TICKS};
use crate::params::{MAX_ACCELERATION, MAX_TRAVEL, MIN_ACCELERATION};
use crate::timing::TICK_US;

const I32: i128 = i32::MAX as i128;
const U32: i128 = u32::MAX as i128;
const I64: i128 = i64::MAX as i128;

/// Highest pulse rate, units a tick: 1.25 million microsteps/s, see
/// [`BuildLimits`](crate::BuildLimits).
const RATE: i128 = 1_250_000 << RATE_BITS;

/// Units of a microstep.
const PULSE: i128 = UNIT as i128;

/// Longest lag of the moving average, ticks.
const LAG_TICKS: i128 = (CELLS as i128 + 2) * CELL_TICKS as i128;

/// Largest number of pulses by which a motor is behind its reference: `Planner::behind`.
const BEHIND: i128 = (RATE / PULSE + 1) * LAG_TICKS;

/// Largest position, Q4 steps.
const TRAVEL: i128 = MAX_TRAVEL as i128;

/// Checks that the bound `value` fits a word whose largest value is `largest`.
fn check(value: i128, largest: i128) {
    assert!((0..=largest).contains(&value), "{value} is beyond {largest}");
}

/// Returns the change of a rate in a tick, units, at an acceleration in steps/s².
fn delta(acceleration: u32, microsteps: i128) -> i128 {
    let per_second = (i128::from(acceleration) * microsteps) << RATE_BITS;
    check(per_second * i128::from(TICK_US), I64);
    per_second * i128::from(TICK_US) / 1_000_000
}

/// Returns the least change of a rate in a tick, units.
fn least_delta() -> i128 {
    delta(MIN_ACCELERATION, 1)
}

#[test]
fn ramps_fit_their_words() {
    let largest_delta = delta(MAX_ACCELERATION, 16);
    assert!(least_delta() >= 8, "{}", least_delta());
    check(largest_delta, (1 << 24) - 1);
    // `Ramp::to`: the change of a rate; `Ramp::tick`: a remainder is below the ticks.
    check(RATE, I32);
    check(2 * RATE, U32);
    check(2 * (2 * RATE / least_delta() + 1), U32);
    // `Ramp::turned`: at most 256 ticks.
    check((2 * RATE + 2 * RATE * 257 / 2) * 256, I64);
    // `approach`: the margin of one and a half changes, squared.
    check((2 * largest_delta).pow(2), I64);
}

#[test]
fn the_bound_of_a_stop_fits_its_words() {
    let ticks = RATE / least_delta() + 1;
    check((LAG_TICKS + ticks) * 2, U32);
    let line = RATE * (ticks + 1);
    let rounding = ticks * ticks / 4 + 2 * (LAG_TICKS + ticks) + 2;
    check(line + rounding + RATE * LAG_TICKS + PULSE, I64);
    // The distance to a limit from anywhere within the widest travel; in Q4 steps, and in units.
    check(2 * TRAVEL, I32);
    check((2 * TRAVEL + 1) * PULSE, I64);
}

/// `Planner::run_out`: half of the way of a ramp that ends within the travel.
#[test]
fn the_run_out_fits_its_words() {
    let ticks = RATE / least_delta() + 1;
    check(RATE * ticks, I64);
    check(2 * TRAVEL, U32);
    check(PULSE / 16 * 16, U32);
}

#[test]
fn the_safe_zone_fits_its_words() {
    let ticks = i128::from(MAX_SAFE_ZONE_TICKS) + 3 + 2 * i128::from(SAFE_TICKS);
    let product = ((RATE >> 22) + 1) * ticks;
    let distance = (product / 2 + BEHIND + 3) * 16;
    check(product, U32);
    check(BEHIND, U32);
    check(TRAVEL + distance, I32);
}

#[test]
fn the_moving_average_fits_its_words() {
    let (cells, ticks) = (CELLS as i128, i128::from(CELL_TICKS));
    // A cell counts in 32 units, and has the remainder of the last one.
    let cell = (RATE * ticks + 31) / 32;
    check(cell, I32);
    // `Lane::close`: a mean is a rate.
    let sum = cells * cell;
    check(2 * sum / cells, I32);
    // `Lane::close` before the oldest cells go: each of the cells and the present one counts up to
    // one more than the number of cells.
    check((cells + 1) * (sum + cell), I64);
    // `Lane::units_to_come`: each cell counts twice the number of cells at most. So does the sum
    // that is scaled to another number of cells.
    let (to_come, divisor) = (2 * cells * sum, 2 * cells);
    check(to_come >> 16, U32);
    check(((divisor - 1) << 16) + 0xffff, U32);
    check(to_come / divisor * 32 + RATE * LAG_TICKS, I64);
    // `Lane::rate` and its slope.
    check(RATE * 32 + 2 * RATE + 4 * RATE * ticks, I64);
}

#[test]
fn positions_and_jogs_fit_their_words() {
    // `TravelLimit::about`, and the end of a jog: a limit about a zero within the travel.
    check(2 * TRAVEL, I32);
    // `Jogging::wanted`: from the end of a jog to the farthest position; in Q4 steps, and in units.
    check(3 * TRAVEL, I32);
    check((3 * TRAVEL + 1 + BEHIND) * PULSE, I64);
}
