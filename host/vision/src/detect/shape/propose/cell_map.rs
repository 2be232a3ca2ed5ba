//! Likeness to the ball's colour and depth in a window of the image, at a quarter of the size.

use std::ops::Range;

use multiversion::multiversion;

use super::super::ball_colour::BallColour;
use super::super::pyramid::SMALLEST;
use super::super::view::FrameView;
use crate::image::Bgr;

/// Places in a cell, column and row from its first pixel, where depth is read if it is unknown in
/// the middle. The first one with depth counts. They are in the row of the middle, which the
/// processor has at hand.
const OTHER_PLACES: [(usize, usize); 3] = [(1, 2), (3, 2), (0, 2)];

/// A pixel at a quarter of the size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    /// Likeness to the ball's colour, 0 to 1.
    pub(super) likeness: f32,
    /// Metres; infinite where it is unknown.
    pub(super) depth: f32,
}

/// The cells of a window of the image.
#[derive(Debug)]
pub(super) struct CellMap {
    width: usize,
    height: usize,
    /// Column and row of the window's first pixel in the full image.
    origin: (f64, f64),
    /// The cells, row by row, and one for all places outside.
    cells: Vec<Cell>,
}

impl CellMap {
    /// Pixels of the full image in a cell, in either direction.
    pub(super) const FACTOR: f64 = SMALLEST as f64;

    /// Reads the cells of the window of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let level = &view.levels[2];
        let outside = Cell { likeness: 0.0, depth: f32::INFINITY };
        let mut cells = vec![outside; level.pixels.len() + 1];
        let scale = view.intrinsics().depth_scale as f32;
        read_cells(&mut cells, level.pixels, view.colour.ball(), &view.small_depth, scale);
        Self { width: level.width, height: level.height, origin: level.origin, cells }
    }

    /// Reads the depth at other places in the cells of at least half the likeness `least` without
    /// depth. Returns column and row of the cells of at least `least` that have one of `depths`,
    /// metres.
    pub(super) fn coloured(
        &mut self,
        view: &FrameView,
        least: f32,
        depths: &Range<f32>,
    ) -> Vec<(usize, usize)> {
        let first = (self.origin.0 as usize, self.origin.1 as usize);
        let mut coloured = Vec::new();
        for (y, row) in (0..self.height).zip(self.cells.chunks_exact_mut(self.width)) {
            for (x, cell) in row.iter_mut().enumerate() {
                if cell.likeness < least / 2.0 {
                    continue;
                }
                if cell.depth == f32::INFINITY {
                    let (column, row) = (first.0 + SMALLEST * x, first.1 + SMALLEST * y);
                    let at = |&(dx, dy): &_| view.depth.at_pixel(column + dx, row + dy);
                    let Some(z) = OTHER_PLACES.iter().find_map(at) else { continue };
                    cell.depth = z as f32;
                }
                if cell.likeness >= least && depths.contains(&cell.depth) {
                    coloured.push((x, y));
                }
            }
        }
        coloured
    }

    /// Returns the cell at column `x`, row `y`. A cell outside has no colour and no depth.
    #[inline]
    pub(super) fn at(&self, x: i32, y: i32) -> &Cell {
        // A negative number becomes a large one.
        let (x, y) = (x as u32 as usize, y as u32 as usize);
        let is_inside = x < self.width && y < self.height;
        &self.cells[if is_inside { y * self.width + x } else { self.cells.len() - 1 }]
    }

    /// Returns column and row in the full image of the centre of the cell at column `x`, row `y`.
    #[inline]
    pub(super) fn to_full(&self, x: usize, y: usize) -> (f64, f64) {
        let full = |k: usize, origin: f64| (k as f64 + 0.5) * Self::FACTOR - 0.5 + origin;
        (full(x, self.origin.0), full(y, self.origin.1))
    }
}

/// Writes the cells of pixels and their raw depths, which are 0 where the depth is unknown; `scale`
/// is that of the raw depths, units in a metre.
#[multiversion(targets("x86_64+avx2"))]
fn read_cells(cells: &mut [Cell], pixels: &[Bgr], ball: BallColour, depths: &[u16], scale: f32) {
    for ((cell, pixel), &raw) in cells.iter_mut().zip(pixels).zip(depths) {
        let depth = if raw == 0 { f32::INFINITY } else { f32::from(raw) / scale };
        *cell = Cell { likeness: ball.likeness(pixel.map(f32::from)), depth };
    }
}
