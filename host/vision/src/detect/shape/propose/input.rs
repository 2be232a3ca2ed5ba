//! Input of the proposer: a window of the frame at a quarter of the size or less.

use std::borrow::Cow;

use multiversion::multiversion;

use super::super::ball_colour::HueTurn;
use super::super::network::Map;
use super::super::pyramid::Level;
use super::super::view::FrameView;
use crate::image::Bgr;

/// Columns and rows of the input are a multiple of this.
const INPUT_STEP: usize = 4;
/// Largest radius that is expected by depth, input pixels.
const MAX_EXPECTED: f64 = 30.0;
/// Unit of the expected radius, input pixels.
const EXPECTED_UNIT: f64 = 10.0;
/// Distance of the middle of a ball's visible surface from its centre, in its radius.
const SURFACE: f64 = 0.7;

/// Returns the network's input for `level` of `view`, one at a quarter of the size or less.
///
/// The channels are red, green and blue from -1 to 1, turned so that the ball's hue is red, the
/// radius that a ball has at the depth (0 where that is unknown), and whether the depth is known.
/// Without depth the last two are missing.
pub(super) fn network_input(view: &FrameView, level: &Level) -> Map {
    let columns = level.width.next_multiple_of(INPUT_STEP);
    let rows = level.height.next_multiple_of(INPUT_STEP);
    let mut input = Map::input(rows, columns, view.has_depth);
    let (turn, expected_radius) =
        (view.colour.ball().turn_to_red(), ExpectedRadius::new(view, level));
    let [red, green, blue, expected, known] = input.channels_mut();
    for y in 0..rows {
        let row = y * columns..(y + 1) * columns;
        let planes = [&mut red[row.clone()], &mut green[row.clone()], &mut blue[row.clone()]];
        let line = y.min(level.height - 1) * level.width;
        let line = line..line + level.width;
        read_colours(&level.pixels[line.clone()], &turn, planes);
        if view.has_depth && y < level.height {
            let rows = [&mut expected[row.clone()], &mut known[row]];
            read_depths(&level_depths(view, level, y), &expected_radius, rows);
        }
    }
    input
}

/// Returns the raw depths in the middle of the pixels in row `y` of `level`.
fn level_depths<'a>(view: &'a FrameView, level: &Level, y: usize) -> Cow<'a, [u16]> {
    let quarter = view.quarter();
    let step = (quarter.scale / level.scale) as usize;
    let first = (y * step + step / 2) * quarter.width + step / 2;
    let line = &view.small_depth[first..];
    if step == 1 {
        return Cow::Borrowed(&line[..level.width]);
    }
    line.iter().step_by(step).take(level.width).copied().collect()
}

/// Writes the turned colours of a line of pixels, from -1 to 1, to rows of red, green and blue. The
/// last colour repeats to the end of the rows.
#[multiversion(targets("x86_64+avx2"))]
fn read_colours(line: &[Bgr], turn: &HueTurn, planes: [&mut [f32]; 3]) {
    let count = line.len();
    let [red, green, blue] = planes;
    let places = red[..count].iter_mut().zip(&mut green[..count]).zip(&mut blue[..count]);
    for (pixel, ((red, green), blue)) in line.iter().zip(places) {
        let [r, g, b] = turn.apply(pixel.map(f32::from));
        (*red, *green, *blue) = (r / 127.5 - 1.0, g / 127.5 - 1.0, b / 127.5 - 1.0);
    }
    for plane in [red, green, blue] {
        let last = plane[count - 1];
        plane[count..].fill(last);
    }
}

/// The radius that a ball has at a depth.
struct ExpectedRadius {
    /// Expected radius times the depth of the ball's centre, units of the network times metres.
    numerator: f32,
    /// Raw units of depth in a metre.
    scale: f32,
    /// Distance from the visible surface to the centre, metres.
    surface: f32,
}

impl ExpectedRadius {
    /// Makes the rule for the ball and the camera of `view` in pixels of `level`.
    fn new(view: &FrameView, level: &Level) -> Self {
        Self {
            numerator: (view.radius_at(1.0) * level.scale / EXPECTED_UNIT) as f32,
            scale: view.intrinsics().depth_scale as f32,
            surface: (SURFACE * view.ball_radius) as f32,
        }
    }
}

/// Writes the radius that a ball has at each depth (raw, 0 where it is unknown), and whether the
/// depth is known, to rows. Where there are no depths, the rows stay as they are.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_depths(depths: &[u16], rule: &ExpectedRadius, rows: [&mut [f32]; 2]) {
    let most = (MAX_EXPECTED / EXPECTED_UNIT) as f32;
    let [expected, known] = rows;
    let places = expected.iter_mut().zip(known);
    for (&raw, (expected, known)) in depths.iter().zip(places) {
        let radius = rule.numerator / (f32::from(raw) / rule.scale + rule.surface);
        let radius = if radius < most { radius } else { most };
        (*expected, *known) = if raw == 0 { (0.0, 0.0) } else { (radius, 1.0) };
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::ball_colour::BallColour;
    use super::*;

    #[test]
    fn colours_go_from_black_to_white_and_the_last_one_repeats() {
        let line = [[0, 0, 255], [255, 255, 0], [51, 102, 204]];
        let mut rows = [[9.0_f32; 4]; 3];
        let [red, green, blue] = &mut rows;
        let turn = BallColour::new(0.0).turn_to_red();
        read_colours(&line, &turn, [red, green, blue]);
        let expected = [[1.0, -1.0, 0.6, 0.6], [-1.0, 1.0, -0.2, -0.2], [-1.0, 1.0, -0.6, -0.6]];
        let pairs = rows.as_flattened().iter().zip(expected.as_flattened());
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-6), "{rows:?}");
    }

    #[test]
    fn a_depth_gives_the_radius_that_a_ball_has_there() {
        // A ball of 1.8 units at 1 m, whose surface is 0.02 m nearer than its centre.
        let rule = ExpectedRadius { numerator: 1.8, scale: 1000.0, surface: 0.02 };
        let depths = [880, 0, 40, 1780];
        let (mut expected, mut known) = ([9.0; 5], [9.0; 5]);
        read_depths(&depths, &rule, [&mut expected, &mut known]);
        // Near depths count as the largest radius; there is no fifth depth.
        let pairs = expected.iter().zip([2.0, 0.0, 3.0, 1.0, 9.0]);
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-6), "{expected:?}");
        assert_eq!(known, [1.0, 0.0, 1.0, 1.0, 9.0]);
    }
}
