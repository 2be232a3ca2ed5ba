//! What spoils a frame after the exposure: compression, and depth that is missing.

use plumb_pictures::{decode, jpeg};
use plumb_sim::synthetic::SyntheticError;
use plumb_vision::camera::Intrinsics;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::{ColourImage, DepthImage, Image};
use rand::{Rng, RngExt};

use super::kind::DepthState;
use crate::vision::BoxedError;

/// Size of the patches of missing depth, pixels.
const PATCH: usize = 40;

/// Returns `frame` with its colour compressed to a JPEG of `quality` (1 to 100) and back.
pub(super) fn compressed(frame: &RgbdFrame, quality: u8) -> Result<RgbdFrame, BoxedError> {
    let bytes = jpeg::encode(frame.colour(), quality)?;
    let colour = decode::colour(&bytes)?;
    made(frame.time(), colour, frame.depth().clone(), *frame.intrinsics())
}

/// Returns `frame` with the part of its depth that `state` leaves; where that is none, as from a
/// camera without depth.
pub(super) fn depleted(
    frame: RgbdFrame,
    state: DepthState,
    random: &mut impl Rng,
) -> Result<RgbdFrame, BoxedError> {
    let (width, height) = (frame.depth().width(), frame.depth().height());
    let (lens, colour) = (*frame.intrinsics(), frame.colour().clone());
    match state {
        DepthState::Complete | DepthState::Shifted => Ok(frame),
        DepthState::Missing => {
            let without = Intrinsics { depth_scale: 0.0, ..lens };
            made(frame.time(), colour, Image::filled(width, height, 0), without)
        }
        DepthState::Half => made(frame.time(), colour, half(frame.depth(), random), lens),
    }
}

/// Returns `depth` without about half of it: in patches, and pixel by pixel along their edges.
fn half(depth: &DepthImage, random: &mut impl Rng) -> DepthImage {
    let (columns, rows) = (depth.width() / PATCH + 2, depth.height() / PATCH + 2);
    let corners: Vec<f64> = (0..columns * rows).map(|_| random.random_range(0.0..1.0)).collect();
    let corner = |column: usize, row: usize| corners[row * columns + column];
    Image::from_fn(depth.width(), depth.height(), |column, row| {
        let (x, y) = (column / PATCH, row / PATCH);
        let across = (column % PATCH) as f64 / PATCH as f64;
        let down = (row % PATCH) as f64 / PATCH as f64;
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let above = mix(corner(x, y), corner(x + 1, y), across);
        let below = mix(corner(x, y + 1), corner(x + 1, y + 1), across);
        let lost = mix(above, below, down) + random.random_range(-0.05..0.05) < 0.5;
        if lost { 0 } else { depth.get(column, row).unwrap_or(0) }
    })
}

/// Returns a frame of these images.
fn made(
    time: f64,
    colour: ColourImage,
    depth: DepthImage,
    lens: Intrinsics,
) -> Result<RgbdFrame, BoxedError> {
    Ok(RgbdFrame::new(time, colour, depth, lens).map_err(SyntheticError::from)?)
}
