//! Moving average over the step plan: it filters out what makes a ball on soft cables swing.
//!
//! The reference's rates are summed in cells of [`CELL_TICKS`] ticks. The motors' rates go linearly
//! from the mean of the last cells to the next such mean. A mean of rates within limits is within
//! them, and so are its changes.
//!
//! The span may change while motors turn. To become longer, it keeps its oldest cell when the next
//! one comes. To become shorter, it drops two cells, where the rates then change little more than
//! with one. So a span goes from 400 ms to 200 ms in 200 ms at best, and rates stay continuous.

use core::cmp::Ordering;

use plumb_protocol::dimension::{MOTORS, PerMotor};

use crate::timing::{MAX_MEAN_MS, TICK_US};
use crate::vector::per_motor;
use crate::wide;

/// Ticks in a cell: 3.2 ms.
pub(super) const CELL_TICKS: i64 = 16;

/// Cells kept: 409.6 ms, 1.5 kB of RAM for three motors.
pub(super) const CELLS: usize = 128;

const _: () = assert!(MAX_MEAN_MS as i64 * 1000 <= CELLS as i64 * CELL_TICKS * TICK_US as i64);

/// Returns the mean time by which the motors are behind the reference, µs, with an average over
/// `span_ms`: half of the span, and one and a half cells.
pub(crate) fn mean_lag_us(span_ms: u16) -> u64 {
    const CELL_US: u64 = CELL_TICKS as u64 * TICK_US as u64;
    if span_ms == 0 { 0 } else { u64::from(span_ms) * 500 + CELL_US * 3 / 2 }
}

/// Moving average of one motor.
#[derive(Debug, Clone, Copy)]
struct Lane {
    /// Movement of the reference in each cell, in 32 units.
    cells: [i32; CELLS],
    /// Cells in a row, up to the newest, in which the reference stood still; at rest all of them.
    quiet: u32,
    /// Sum of the cells of the span; 38 bits.
    sum: i64,
    /// The sum before the newest cell, as one of the present number of cells.
    sum_before: i64,
    /// Sum of the cells, each times the number of means that it will be part of, with the present
    /// one: 1 for the oldest cell, the number of cells for the newest. 45 bits.
    weighted: i64,
    /// Movement of the reference in the present cell, units.
    moved: i64,
    /// Rates at the beginning and at the end of the present cell.
    span: (i32, i32),
    /// Rate at the middle of the coming tick, times 32. 38 bits.
    rate: i64,
    /// Change of `rate` a tick. 38 bits.
    slope: i64,
    /// Movement of the motor that follows if the reference stands still, units; without the
    /// rounding of the present cell and of later ones.
    ahead: i64,
}

/// Moving averages of three motors.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovingAverage {
    lanes: PerMotor<Lane>,
    /// Cells of the longest span; 0 switches the average off.
    longest: usize,
    /// Cells of the span that is wanted: 1 to `longest`.
    wanted: usize,
    /// Cells of the present span.
    length: usize,
    /// Index of the cell that the present one replaces.
    at: usize,
    /// Ticks passed in the present cell.
    tick: i64,
}

impl MovingAverage {
    pub(super) const OFF: Self = Self::of_cells(0);

    /// Creates an average over `cells` at standstill.
    const fn of_cells(cells: usize) -> Self {
        Self {
            lanes: [Lane::AT_REST; MOTORS],
            longest: cells,
            wanted: cells,
            length: cells,
            at: 0,
            tick: 0,
        }
    }

    /// Creates an average over `span_ms`, at most [`MAX_MEAN_MS`], at standstill.
    pub(super) fn over(span_ms: u16) -> Self {
        Self::of_cells(cells(span_ms))
    }

    /// Returns an average of the same longest span at standstill.
    pub(super) fn emptied(&self) -> Self {
        Self::of_cells(self.longest)
    }

    /// Begins to change the span to `span_ms`: at most the one that the average was created with,
    /// and a cell at least.
    pub(super) fn want(&mut self, span_ms: u16) {
        self.wanted = cells(span_ms).max(1).min(self.longest);
    }

    /// Returns the motors' rates in a tick in which the reference moves at `reference`.
    /// [`pass`](Self::pass) then enters that tick.
    pub(super) fn rates(&self, reference: PerMotor<i32>) -> PerMotor<i32> {
        if self.is_off() {
            return reference;
        }
        let [a, b, c] = &self.lanes;
        [a.now(), b.now(), c.now()]
    }

    /// Enters a tick in which the reference moved at `reference`. The rates of the motors change by
    /// at most `deltas` a tick. The span changes only where `may_change`: then the motors come to
    /// rest elsewhere than [`ahead`](Self::ahead) said.
    #[inline(never)]
    pub(super) fn pass(
        &mut self,
        reference: PerMotor<i32>,
        deltas: &PerMotor<u32>,
        may_change: bool,
    ) {
        for (lane, wanted) in self.lanes.iter_mut().zip(reference) {
            lane.moved += i64::from(wanted);
            lane.ahead += i64::from(wanted) - i64::from(lane.now());
            lane.rate += lane.slope;
        }
        self.tick += 1;
        if self.tick == CELL_TICKS {
            self.tick = 0;
            let next = if may_change { self.next_length(deltas) } else { self.length };
            self.lanes.iter_mut().for_each(|lane| lane.close(self.at, self.length, next));
            self.length = next;
            self.at = (self.at + 1) % CELLS;
        }
    }

    /// Returns the number of cells of the span after the present cell.
    fn next_length(&self, deltas: &PerMotor<u32>) -> usize {
        let (at, length) = (self.at, self.length);
        match self.wanted.cmp(&length) {
            Ordering::Equal => length,
            Ordering::Greater => length + 1,
            Ordering::Less => {
                let fits = |(lane, delta): (&Lane, &u32)| lane.can_shrink(at, length, *delta);
                if self.lanes.iter().zip(deltas).all(fits) { length - 1 } else { length }
            }
        }
    }

    /// Returns the movement of each motor that follows if the reference stands still, units.
    pub(super) fn ahead(&self) -> PerMotor<i64> {
        per_motor(|i| self.lanes[i].ahead)
    }

    /// Returns whether no average is configured.
    pub(super) fn is_off(&self) -> bool {
        self.longest == 0
    }

    /// Returns the ticks that the motors are behind the reference at most: the cells of the longest
    /// span, the present cell, and the one in which the rates change.
    pub(super) fn lag_ticks(&self) -> u32 {
        if self.is_off() { 0 } else { (self.longest as u32 + 2) * CELL_TICKS as u32 }
    }

    /// Returns whether motors still follow.
    pub(super) fn moving(&self) -> bool {
        self.lanes.iter().any(|lane| lane.moving(self.length))
    }
}

impl Lane {
    const AT_REST: Self = Self {
        cells: [0; CELLS],
        quiet: u32::MAX,
        sum: 0,
        sum_before: 0,
        weighted: 0,
        moved: 0,
        span: (0, 0),
        rate: 0,
        slope: 0,
        ahead: 0,
    };

    /// Returns whether the motor still follows its reference with a span of `length` cells.
    fn moving(&self, length: usize) -> bool {
        // A sum of 0 is not enough: after a move there and back within the span, the cells hold
        // both. After a span that became shorter, the cell that it dropped may still be in the rate
        // at the beginning.
        let filled = self.quiet <= length as u32 || !(0..32).contains(&self.moved);
        filled || self.span.0 != 0
    }

    /// Returns the rate of the coming tick.
    fn now(&self) -> i32 {
        (self.rate >> 5) as i32
    }

    /// Returns the movement that `length` cells still cause if the reference stands still, units,
    /// rounded towards zero, without the rounding of rates.
    fn units_to_come(&self, length: usize) -> i64 {
        // The rates pass the mean before the newest cell by a half, and every later one as a whole.
        (quotient(self.sum_before + 2 * self.weighted, 2 * length as u32)) << 5
    }

    /// Returns whether a span that is shorter by a cell changes the rate by at most `delta` more
    /// than the present span. The present cell, number `at` after `length` others, has ended.
    #[inline(never)]
    fn can_shrink(&self, at: usize, length: usize, delta: u32) -> bool {
        let oldest = |length| i64::from(self.cells[before(at, length)]);
        let kept = self.sum + (self.moved >> 5) - oldest(length);
        let shrunk = kept - oldest(length - 1);
        let change =
            |sum, length| (i64::from(mean(sum, length)) - i64::from(self.span.1)).unsigned_abs();
        let most = u64::from(delta) * CELL_TICKS as u64;
        change(shrunk, length - 1) <= (change(kept, length) + u64::from(delta)).min(most)
    }

    /// Ends the present cell, number `at` after the `length` cells of the span. The next span has
    /// `next` cells: one more, as many, or one less.
    fn close(&mut self, at: usize, length: usize, next: usize) {
        // The remainder stays for the next cell. Bits: rate 31 + ticks 4 - 5.
        let cell = (self.moved >> 5) as i32;
        self.moved &= 31;
        self.quiet = if cell == 0 { self.quiet.saturating_add(1) } else { 0 };
        self.sum_before = match next == length {
            true => self.sum,
            false => wide::signed_product(self.span.1, next as i32) / 2,
        };
        // The cell will be part of `length` + 1 means, and each of the oldest cells that go takes
        // one mean from every cell.
        self.sum += i64::from(cell);
        self.weighted += i64::from(cell) * (length as i64 + 1);
        for length in (next..=length).rev() {
            self.weighted -= self.sum;
            self.sum -= i64::from(self.cells[before(at, length)]);
        }
        self.cells[at] = cell;
        self.span = (self.span.1, mean(self.sum, next));
        let change = i64::from(self.span.1) - i64::from(self.span.0);
        (self.rate, self.slope) = (i64::from(self.span.0) * 32 + change, 2 * change);
        if self.quiet > length.max(next) as u32 {
            // Every cell is 0, and so are both means of the present cell. The remainders of
            // rounding are dropped: less than a thousandth of a microstep.
            (self.weighted, self.sum_before, self.moved) = (0, 0, 0);
        }
        // The rounding of the cell that ends is over.
        self.ahead = self.units_to_come(next) + self.moved;
    }
}

/// Returns the number of whole cells in `span_ms`, at most [`CELLS`].
fn cells(span_ms: u16) -> usize {
    const { assert!(CELL_TICKS * TICK_US as i64 == 3200) };
    (usize::from(span_ms) * 10 / 32).min(CELLS)
}

/// Returns the index of the cell that ended `cells` cells (1 to [`CELLS`]) before number `at`.
fn before(at: usize, cells: usize) -> usize {
    (at + CELLS - cells) % CELLS
}

/// Returns the rate of a motor that moves by `sum` in `length` cells, rounded towards zero. A mean
/// of rates has the bits of a rate: 31.
#[inline(never)]
fn mean(sum: i64, length: usize) -> i32 {
    let mean = wide::quotient(sum.unsigned_abs() * 2, length as u32) as i32;
    if sum < 0 { -mean } else { mean }
}

/// Returns `value` (47 bits and the sign) over `divisor` (8 bits), rounded towards zero.
fn quotient(value: i64, divisor: u32) -> i64 {
    // Two divisions of 32 bits: the upper 47 - 16 bits, then 9 bits of remainder with the lower 16
    // bits.
    let (size, low) = (value.unsigned_abs(), value.unsigned_abs() as u32 & 0xffff);
    let high = (size >> 16) as u32;
    let lower = ((high % divisor) << 16 | low) / divisor;
    let quotient = (u64::from(high / divisor) << 16 | u64::from(lower)) as i64;
    if value < 0 { -quotient } else { quotient }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;

    /// Largest change of a rate in the tests.
    const DELTAS: [u32; 3] = [1 << 20; 3];

    proptest! {
        /// Once the reference stands still, the motors move by what is ahead in every tick, and
        /// they rest within the lag. The rounding is that of
        /// [`Stop`](super::super::travel_limit::Stop).
        #[test]
        fn the_motors_move_by_what_is_ahead(
            length in 1usize..=CELLS,
            references in proptest::collection::vec(
                (proptest::array::uniform3(-1_280_000_000i32..=1_280_000_000), 1usize..200,
                 0u16..=400), 1..6),
        ) {
            let mut mean = MovingAverage::of_cells(length);
            for (reference, ticks, span_ms) in references {
                mean.want(span_ms);
                (0..ticks).for_each(|_| mean.pass(reference, &DELTAS, true));
            }
            let mut ticks = Vec::new();
            while mean.moving() {
                ticks.push((mean.ahead(), mean.rates([0; 3])));
                mean.pass([0; 3], &DELTAS, false);
            }
            prop_assert_eq!((mean.ahead(), mean.rates([0; 3])), ([0; 3], [0; 3]));
            prop_assert!(ticks.len() <= mean.lag_ticks() as usize);
            let rounding = 2 * i64::from(mean.lag_ticks());
            let mut left = [0; 3];
            for (ahead, rates) in ticks.iter().rev() {
                for i in 0..3 {
                    left[i] += i64::from(rates[i]);
                    prop_assert!((ahead[i] - left[i]).abs() <= rounding, "{ahead:?} {left:?}");
                }
            }
        }
    }

    proptest! {
        /// A span that becomes shorter during a stop drops cells early. The motors turn until the
        /// rate has gone to the last mean.
        #[test]
        fn motors_that_no_longer_follow_rest(
            length in 1usize..=CELLS, reference in -1_280_000_000i32..=1_280_000_000,
            ticks in 1usize..2_500, span_ms in 0u16..=400,
        ) {
            let mut mean = MovingAverage::of_cells(length);
            (0..ticks).for_each(|_| mean.pass([reference, 0, 0], &DELTAS, true));
            mean.want(span_ms);
            while mean.moving() {
                mean.pass([0; 3], &DELTAS, true);
            }
            for _ in 0..3 * CELL_TICKS {
                prop_assert_eq!((mean.ahead(), mean.rates([0; 3])), ([0; 3], [0; 3]));
                mean.pass([0; 3], &DELTAS, true);
            }
        }
    }

    #[test]
    fn the_lag_ends_with_the_last_movement() {
        for length in [1, 3, 31, 125] {
            let mut mean = MovingAverage::of_cells(length);
            mean.pass([1_280_000_000, 0, 0], &DELTAS, false);
            let mut last = 0;
            for tick in 1..10_000 {
                if mean.rates([0; 3]) != [0; 3] {
                    last = tick;
                }
                mean.pass([0; 3], &DELTAS, false);
            }
            let lag = mean.lag_ticks();
            assert!((lag - 2..lag).contains(&last), "{length} cells: {last} of {lag}");
        }
    }

    /// A cell counts in 32 units.
    #[test]
    fn the_remainder_of_a_cell_is_ahead() {
        let mut mean = MovingAverage::of_cells(125);
        mean.pass([33, 0, 0], &DELTAS, false);
        (1..CELL_TICKS).for_each(|_| mean.pass([0; 3], &DELTAS, false));
        assert_eq!(mean.ahead(), [33, 0, 0]);
    }
}
