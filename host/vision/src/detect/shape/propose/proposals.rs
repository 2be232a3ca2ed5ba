//! Proposals: the places with the highest odds, the most promising first.

use super::super::network::{CELL, Map, Networks, RADIUS_UNIT};
use super::super::pyramid::Level;
use super::super::view::{Disc, FrameView};
use super::input::network_input;

/// Cells of the output in a pixel of the network's head, in either direction.
const HEAD_CELLS: usize = 2;

/// A disc that may be the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    /// The disc, as the network sees it.
    pub disc: Disc,
    /// Its log-odds by the network.
    pub log_odds: f64,
    /// Whether the screen judged it.
    pub is_judged: bool,
}

/// Log-odds that the ball's centre is in a cell, for each cell of a window.
#[derive(Debug, Clone, PartialEq)]
pub struct OddsMap {
    width: usize,
    height: usize,
    /// First column and row of the window.
    origin: (f64, f64),
    /// Pixels of the full image in a cell, in either direction.
    side: f64,
    values: Vec<f32>,
}

impl OddsMap {
    /// Returns the log-odds at column `u`, row `v` of the full image; `None` outside the window.
    pub fn at(&self, u: f64, v: f64) -> Option<f32> {
        let x = (u + 0.5 - self.origin.0) / self.side;
        let y = (v + 0.5 - self.origin.1) / self.side;
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| self.values[y as usize * self.width + x as usize])
    }

    /// Checks whether no neighbour of the cell has higher odds; of equal ones the first counts.
    fn is_peak(&self, x: usize, y: usize) -> bool {
        let own = self.values[y * self.width + x];
        let rows = y.saturating_sub(1)..(y + 2).min(self.height);
        let mut places =
            rows.flat_map(|v| (x.saturating_sub(1)..(x + 2).min(self.width)).map(move |u| (u, v)));
        places.all(|(u, v)| {
            let other = self.values[v * self.width + u];
            if (v, u) < (y, x) { own > other } else { own >= other }
        })
    }
}

/// Returns the odds of each cell of the window of `view`, and the proposals. The network reads it
/// at `level`, a quarter of the size or less.
pub(in super::super) fn propose(view: &FrameView, level: &Level) -> (OddsMap, Vec<Proposal>) {
    let parameters = &view.parameters.propose;
    let head = Networks::get().proposer.apply(&network_input(view, level));
    let (width, height) = (head.columns * HEAD_CELLS, head.rows * HEAD_CELLS);
    let read = |quantity: usize, x: usize, y: usize| {
        let channel = (quantity * HEAD_CELLS + y % HEAD_CELLS) * HEAD_CELLS + x % HEAD_CELLS;
        head.at(channel, x / HEAD_CELLS, y / HEAD_CELLS)
    };
    let (origin, pixel) = (level.origin, 1.0 / level.scale);
    let side = CELL as f64 * pixel;
    let odds = OddsMap { width, height, origin, side, values: cells_of(&head) };
    let full = |cell: usize, offset: f32, origin: f64| {
        (cell as f64 + 0.5 + f64::from(offset)) * side - 0.5 + origin
    };
    let least = if view.has_depth {
        parameters.min_log_odds_with_depth
    } else {
        parameters.min_log_odds_without_depth
    };
    let likely = odds.values.iter().enumerate().filter(|place| *place.1 >= least);
    let peaks = likely.map(|(i, _)| (i % width, i / width)).filter(|&(x, y)| odds.is_peak(x, y));
    let mut proposals: Vec<Proposal> = peaks
        .map(|(x, y)| {
            let u = full(x, read(1, x, y), origin.0);
            let v = full(y, read(2, x, y), origin.1);
            let radius = f64::from(read(3, x, y)).exp() * RADIUS_UNIT * pixel;
            let log_odds = f64::from(read(0, x, y));
            Proposal { disc: Disc { u, v, radius }, log_odds, is_judged: false }
        })
        .collect();
    proposals.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    (odds, proposals)
}

/// Returns the log-odds of the cells, row by row.
fn cells_of(head: &Map) -> Vec<f32> {
    let width = HEAD_CELLS * head.columns;
    let mut values = vec![0.0; width * HEAD_CELLS * head.rows];
    for channel in 0..HEAD_CELLS * HEAD_CELLS {
        let (left, top) = (channel % HEAD_CELLS, channel / HEAD_CELLS);
        let lines = values.chunks_exact_mut(width).skip(top).step_by(HEAD_CELLS);
        for (line, odds) in lines.zip(head.rows_of(channel)) {
            let cells = line.iter_mut().skip(left).step_by(HEAD_CELLS);
            cells.zip(odds).for_each(|(cell, &odds)| *cell = odds);
        }
    }
    values
}
