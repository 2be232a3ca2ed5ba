//! Likeness to the ball's colour and depth in a window of the image, at a quarter of the size.

use std::ops::Range;

use multiversion::multiversion;

use super::super::ball_colour::BallColour;
use super::super::pyramid::{Level, SMALLEST};
use super::super::view::FrameView;
use super::cell_rules::{Continuation, ReachRule};
use crate::image::Bgr;

/// Places in a cell, column and row from its first pixel, where depth is read if it is unknown in
/// the middle. The first one with depth counts. They are in the row of the middle, which the
/// processor has at hand.
const OTHER_PLACES: [(usize, usize); 3] = [(1, 2), (3, 2), (0, 2)];

/// Columns and rows from a cell to another.
pub(super) type Step = (isize, isize);

/// The cells of a window of the image, row by row.
#[derive(Debug)]
pub(super) struct CellMap {
    width: usize,
    /// Column and row of the window's first pixel in the full image.
    origin: (f64, f64),
    /// Likeness to the ball's colour, 0 to 1.
    likeness: Vec<f32>,
    /// Depth, metres; infinite where it is unknown.
    depth: Vec<f32>,
    /// Reach of the cell by the [`ReachRule`].
    reach: Vec<f32>,
    continuation: Continuation,
}

impl CellMap {
    /// Pixels of the full image in a cell, in either direction.
    pub(super) const FACTOR: f64 = SMALLEST as f64;

    /// Reads the cells of the window of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let (level, continuation) = (&view.levels[2], Continuation::new(view));
        let zeros = vec![0.0; level.pixels.len()];
        let [mut likeness, mut depth, mut reach] = [zeros.clone(), zeros.clone(), zeros];
        read_likeness(&mut likeness, level.pixels, view.colour.ball());
        read_depth(&mut depth, &view.small_depth, view.intrinsics().depth_scale as f32);
        read_missing_depth(&mut depth, &likeness, continuation.least, view, level);
        read_reach(&mut reach, &likeness, &depth, &ReachRule::new(view));
        let (width, origin) = (level.width, level.origin);
        Self { width, origin, likeness, depth, reach, continuation }
    }

    /// Returns the reaches, row by row.
    pub(super) fn reaches(&self) -> impl Iterator<Item = &[f32]> {
        self.reach.chunks_exact(self.width)
    }

    /// Returns the depth of the cell at column `x`, row `y`, metres.
    pub(super) fn depth(&self, x: usize, y: usize) -> f64 {
        f64::from(self.depth[y * self.width + x])
    }

    /// Returns column and row in the full image of the centre of the cell at column `x`, row `y`.
    pub(super) fn to_full(&self, x: usize, y: usize) -> (f64, f64) {
        let full = |k: usize, origin: f64| (k as f64 + 0.5) * Self::FACTOR - 0.5 + origin;
        (full(x, self.origin.0), full(y, self.origin.1))
    }

    /// Checks whether the surface of the cell at column `x`, row `y` continues a step away. Out of
    /// the window no surface continues.
    pub(super) fn continues(&self, x: usize, y: usize, (dx, dy): Step) -> bool {
        let column = x.checked_add_signed(dx).filter(|column| *column < self.width);
        let row = y.checked_add_signed(dy).filter(|row| *row < self.rows());
        column.zip(row).is_some_and(|(column, row)| {
            let cells = [y * self.width + x, row * self.width + column];
            let [own, other] = cells.map(|cell| (self.likeness[cell], self.depth[cell]));
            self.continuation.holds(own, other)
        })
    }

    /// Adds 1 to the count of each cell of row `y` that has this `reach` and whose surface continues
    /// a step away. Out of the window no surface continues.
    pub(super) fn add_continued(&self, counts: &mut [f32], y: usize, reach: f32, (dx, dy): Step) {
        let Some(row) = y.checked_add_signed(dy).filter(|row| *row < self.rows()) else { return };
        // The columns from which the step leads to a column of the window.
        let first = dx.min(0).unsigned_abs();
        let end = self.width.saturating_sub(dx.max(0).unsigned_abs());
        if first < end {
            let own = self.row(first..end, y);
            let others = self.row(first.strict_add_signed(dx)..end.strict_add_signed(dx), row);
            add_continued(&mut counts[first..end], own, others, reach, self.continuation);
        }
    }

    /// Returns the number of rows.
    fn rows(&self) -> usize {
        self.depth.len() / self.width
    }

    /// Returns likeness, depth and reach of `columns` of row `y`.
    fn row(&self, columns: Range<usize>, y: usize) -> [&[f32]; 3] {
        let cells = y * self.width + columns.start..y * self.width + columns.end;
        [&self.likeness, &self.depth, &self.reach].map(|values| &values[cells.clone()])
    }
}

/// Writes the likeness of each of the pixels to the colour of `ball`.
#[multiversion(targets("x86_64+avx2"))]
fn read_likeness(likeness: &mut [f32], pixels: &[Bgr], ball: BallColour) {
    for (likeness, pixel) in likeness.iter_mut().zip(pixels) {
        *likeness = ball.likeness(pixel.map(f32::from));
    }
}

/// Writes raw depths, which are 0 where the depth is unknown, in metres; `scale` is that of the raw
/// depths, units in a metre.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_depth(depth: &mut [f32], raw: &[u16], scale: f32) {
    for (depth, &raw) in depth.iter_mut().zip(raw) {
        *depth = if raw == 0 { f32::INFINITY } else { f32::from(raw) / scale };
    }
}

/// Reads the depth at other places in the cells of at least the likeness `least` without depth.
fn read_missing_depth(
    depth: &mut [f32],
    likeness: &[f32],
    least: f32,
    view: &FrameView,
    level: &Level,
) {
    let first = (level.origin.0 as usize, level.origin.1 as usize);
    let rows = depth.chunks_exact_mut(level.width).zip(likeness.chunks_exact(level.width));
    for (y, (depth, likeness)) in
        rows.enumerate().filter(|(_, row)| is_missing(row.0, row.1, least))
    {
        for (x, (depth, &likeness)) in depth.iter_mut().zip(likeness).enumerate() {
            if *depth == f32::INFINITY && likeness >= least {
                let (column, row) = (first.0 + SMALLEST * x, first.1 + SMALLEST * y);
                let at = |&(dx, dy): &_| view.depth.at_pixel(column + dx, row + dy);
                *depth = OTHER_PLACES.iter().find_map(at).map_or(f32::INFINITY, |z| z as f32);
            }
        }
    }
}

/// Checks whether a cell of at least the likeness `least` has no depth.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn is_missing(depth: &[f32], likeness: &[f32], least: f32) -> bool {
    let cells = depth.iter().zip(likeness);
    let missing = cells.map(|(&z, &likeness)| (z == f32::INFINITY) & (likeness >= least));
    missing.fold(0, |any, missing| any | u32::from(missing)) != 0
}

/// Writes the reach of each cell.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_reach(reach: &mut [f32], likeness: &[f32], depth: &[f32], rule: &ReachRule) {
    for (reach, (&likeness, &depth)) in reach.iter_mut().zip(likeness.iter().zip(depth)) {
        *reach = rule.reach(likeness, depth);
    }
}

/// Adds 1 to the count of each of the cells `own` that has this `reach` and whose surface continues
/// in the one of `others`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn add_continued(
    counts: &mut [f32],
    [likeness, depth, reaches]: [&[f32]; 3],
    [other_likeness, other_depth, _]: [&[f32]; 3],
    reach: f32,
    rule: Continuation,
) {
    let own = likeness.iter().zip(depth).zip(reaches);
    let others = other_likeness.iter().zip(other_depth);
    for (count, (((&likeness, &depth), &own_reach), (&other, &other_depth))) in
        counts.iter_mut().zip(own.zip(others))
    {
        let continues = rule.holds((likeness, depth), (other, other_depth));
        *count += f32::from(u8::from(continues & (own_reach == reach)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a map of 19 columns and 6 rows.
    fn map() -> CellMap {
        let numbers = |factor: usize| (0..19 * 6).map(move |i| (i * factor % 23) as f32 / 11.0);
        CellMap {
            width: 19,
            origin: (0.0, 0.0),
            likeness: numbers(29).collect(),
            depth: numbers(13).collect(),
            reach: (0..19 * 6).map(|i| (i * 7 % 3) as f32).collect(),
            continuation: Continuation { same_object: 0.4, least: 0.1, behind: 0.5 },
        }
    }

    #[test]
    fn a_row_is_counted_as_its_cells_are() {
        let map = map();
        let steps = [(0, 0), (3, 0), (-2, 1), (1, -5), (18, 2), (-19, 0), (40, 0), (0, 6)];
        for (step, y) in steps.into_iter().flat_map(|step| (0..6).map(move |y| (step, y))) {
            let mut counts = [1.0; 19];
            map.add_continued(&mut counts, y, 2.0, step);
            for (x, count) in counts.into_iter().enumerate() {
                let is_added = map.reach[y * 19 + x] == 2.0 && map.continues(x, y, step);
                assert_eq!(count, if is_added { 2.0 } else { 1.0 }, "{step:?} at {x}, {y}");
            }
        }
    }
}
