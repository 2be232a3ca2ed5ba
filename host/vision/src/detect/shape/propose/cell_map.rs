//! Likeness to the ball's colour, depth, and where a ball there would end, in a window of the image
//! at a quarter of the size. The rules say where a ball's surface can be, and where it continues.

use std::ops::Range;

use multiversion::multiversion;

use super::super::ball_colour::BallColour;
use super::super::pyramid::QUARTER;
use super::super::view::{FrameView, middle_rows};
use crate::image::Bgr;

/// Columns in a cell where the depth is read, in its middle row. The first one with depth counts.
const COLUMNS: [usize; QUARTER] = [2, 1, 3, 0];

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
    /// Reach: distance at which a ball with its surface in the cell has ended, whole cells; 0 where
    /// no ball can be ([`ReachRule`]).
    reach: Vec<f32>,
    continuation: Continuation,
}

impl CellMap {
    /// Pixels of the full image in a cell, in either direction.
    pub(super) const FACTOR: f64 = QUARTER as f64;

    /// Reads the cells of the window of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let level = view.quarter();
        // The depth of a cell that has no pixels of depth is unknown.
        let [mut likeness, mut depth, mut reach] =
            [0.0, f32::INFINITY, 0.0].map(|value| vec![value; level.pixels.len()]);
        read_likeness(&mut likeness, level.pixels, view.colour.ball());
        let (width, origin) = (level.width, level.origin);
        for (depth, raw) in depth.chunks_exact_mut(width).zip(middle_rows(&view.depth, level)) {
            read_depth(depth, raw, view.intrinsics().depth_scale as f32);
        }
        read_reach(&mut reach, &likeness, &depth, &ReachRule::new(view));
        Self { width, origin, likeness, depth, reach, continuation: Continuation::new(view) }
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

    /// Adds 1 to the count of each cell of row `y` that has this `reach` and whose surface
    /// continues a step away. Out of the window no surface continues.
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

/// Writes the depths of the cells of a row, metres. `raw` are the depths of the pixels of its
/// middle row, 0 where they are unknown; `scale` is their units in a metre.
#[multiversion(targets("x86_64+avx512f+avx512bw", "x86_64+avx2"))]
fn read_depth(depth: &mut [f32], raw: &[u16], scale: f32) {
    for (depth, pixels) in depth.iter_mut().zip(raw.as_chunks::<QUARTER>().0) {
        let raw = COLUMNS.iter().rev().fold(0, |raw, &column| match pixels[column] {
            0 => raw,
            known => known,
        });
        *depth = if raw == 0 { f32::INFINITY } else { f32::from(raw) / scale };
    }
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

/// Largest reach of a cell: with it a set of reaches is a number of 64 bits. A ball that has not
/// ended there fills more than 500 rows.
const MAX_REACH: f32 = 63.0;

/// When the surface of a cell continues in another cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Continuation {
    /// Least likeness of the other cell, in that of the cell itself.
    pub(super) same_object: f32,
    /// Least likeness of the other cell, 0 to 1.
    pub(super) least: f32,
    /// Largest depth of the other cell behind the cell, metres. A surface that continues towards
    /// the camera has not ended.
    pub(super) behind: f32,
}

impl Continuation {
    /// Makes the rule for the ball of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let parameters = &view.parameters.clusters;
        let least = parameters.min_likeness / 2.0;
        Self { same_object: parameters.same_object, least, behind: view.ball_radius as f32 }
    }

    /// Checks whether the surface of a cell of this likeness and depth continues in another. Free
    /// of branches, so that the compiler computes many cells at once.
    #[inline(always)]
    pub(super) fn holds(
        &self,
        (likeness, depth): (f32, f32),
        (other, other_depth): (f32, f32),
    ) -> bool {
        let is_alike = other >= (self.same_object * likeness).max(self.least);
        is_alike & (other_depth < depth + self.behind)
    }
}

/// Where a ball's surface can be, and its reach: how far from there the ball has ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReachRule {
    /// Least likeness of a cell, 0 to 1.
    min_likeness: f32,
    /// Depths of a surface, metres.
    depths: Range<f32>,
    /// Radius of the ball, metres: its surface is so much nearer than its centre.
    ball: f32,
    /// The part of the reach that goes with the ball's radius in the image, times the depth of the
    /// ball's centre, cells times metres.
    numerator: f32,
    /// The rest of the reach, cells.
    rest: f32,
}

impl ReachRule {
    /// Makes the rule for the ball and the camera of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let (parameters, ball) = (&view.parameters.clusters, view.ball_radius);
        let surface = |radius| (view.intrinsics().depth_of(ball, radius) - ball) as f32;
        let (radii, beyond) = (view.possible_radii(), parameters.beyond);
        Self {
            min_likeness: parameters.min_likeness,
            depths: surface(radii.end)..surface(radii.start),
            ball: ball as f32,
            numerator: (beyond.relative * view.radius_at(1.0) / CellMap::FACTOR) as f32,
            rest: (beyond.pixels / CellMap::FACTOR) as f32,
        }
    }

    /// Returns the reach of a cell, whole cells up to [`MAX_REACH`]; 0 where no ball can be. Free
    /// of branches.
    #[inline(always)]
    pub(super) fn reach(&self, likeness: f32, depth: f32) -> f32 {
        let is_possible = (depth >= self.depths.start) & (depth < self.depths.end);
        let cells = (self.numerator / (depth + self.ball) + self.rest + 0.5).floor();
        let cells = if cells < MAX_REACH { cells } else { MAX_REACH };
        if is_possible & (likeness >= self.min_likeness) { cells } else { 0.0 }
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
    fn depth_is_read_in_the_middle_of_a_cell_or_beside_it() {
        // The last cell has too few pixels.
        let raw = [1, 2, 3, 4, 5, 6, 0, 7, 8, 0, 0, 9, 10, 0, 0, 0, 0, 0, 0, 0, 11, 12];
        let mut depth = [f32::INFINITY; 6];
        read_depth(&mut depth, &raw, 10.0);
        assert_eq!(depth, [0.3, 0.6, 0.9, 1.0, f32::INFINITY, f32::INFINITY]);
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
