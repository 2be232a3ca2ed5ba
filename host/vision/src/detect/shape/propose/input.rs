//! What the proposing network reads: a window of the frame at a quarter of the size.

use super::super::network::{CHANNELS, Map};
use super::super::pyramid::SMALLEST;
use super::super::view::FrameView;

/// Columns and rows of the input are a multiple of this.
const INPUT_STEP: usize = 4;
/// Largest radius that is expected by depth, input pixels.
const MAX_EXPECTED: f64 = 30.0;
/// Unit of the expected radius, input pixels.
const EXPECTED_UNIT: f64 = 10.0;
/// Distance of the middle of a ball's visible surface from its centre, in its radius.
const SURFACE: f64 = 0.7;

/// Returns the network's input for the window of `view`.
///
/// The channels are red, green and blue from -1 to 1, turned so that the ball's hue is red, the
/// radius that a ball has at the depth (0 where that is unknown), and whether the depth is known.
pub(super) fn network_input(view: &FrameView) -> Map {
    let level = &view.levels[2];
    let columns = level.width.next_multiple_of(INPUT_STEP);
    let rows = level.height.next_multiple_of(INPUT_STEP);
    let mut input = Map::zeros(rows, columns, CHANNELS);
    let turn = view.colour.ball().turn_to_red();
    let middle = |k: usize, origin: f64| origin + (SMALLEST * k + SMALLEST / 2) as f64;
    let unit = (SMALLEST as f64 * EXPECTED_UNIT).recip();
    let (most, surface) = (MAX_EXPECTED / EXPECTED_UNIT, SURFACE * view.ball_radius);
    let (colours, depths) = input.values.split_at_mut(3 * rows * columns);
    let (red, rest) = colours.split_at_mut(rows * columns);
    let (green, blue) = rest.split_at_mut(rows * columns);
    let (expected, known) = depths.split_at_mut(rows * columns);
    for y in 0..rows {
        let line = &level.pixels[y.min(level.height - 1) * level.width..][..level.width];
        let v = middle(y, level.origin.1);
        for x in 0..columns {
            let i = y * columns + x;
            let colour = turn.apply(line[x.min(level.width - 1)].map(f32::from));
            [red[i], green[i], blue[i]] = colour.map(|value| value / 127.5 - 1.0);
            if let Some(z) = view.depth.at(middle(x, level.origin.0), v) {
                expected[i] = (view.radius_at(z + surface) * unit).min(most) as f32;
                known[i] = 1.0;
            }
        }
    }
    input
}
