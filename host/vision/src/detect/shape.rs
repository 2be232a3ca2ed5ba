//! The stages of the detector [`ball`](super::ball).
//!
//! 1. Propose: where depth is known, spheres of the ball's size are fitted to clusters of its
//!    colour. If none of them is certainly the ball, a network (the proposer) reads the image at a
//!    quarter of the size and gives each cell of 8x8 pixels the odds that the ball is there.
//!    If none was found, balls that are too large for that are looked for at an eighth of the size
//!    and less.
//! 2. Screen: a second network (the screen) judges each proposal, and moves it to where it sees the
//!    ball.
//! 3. Refine: the circle of each sphere and proposal is fitted to its edges, to a fraction of a
//!    pixel.
//! 4. Decide: a third network (the judge) and other features of each circle give the probability
//!    that it is the ball. The most probable circle is the ball if its score is high enough;
//!    otherwise there is no ball.
//! 5. Observe: the ball's position follows from the depth on its disc
//!    ([`localise`](crate::localise)).
//!
//! The numbers are in [`ShapeParameters`]; what each stage found in a frame is in a
//! [`DetectionTrace`].

mod ball_colour;
mod decide;
mod disc_depth;
mod flat_disc;
mod network;
mod parameters;
mod propose;
mod pyramid;
mod radial_scan;
mod ray_colours;
mod refine;
mod robust_fit;
mod search;
mod trace;
mod view;

use crate::camera::Camera;
use crate::frame::RgbdFrame;

pub(crate) use decide::probability;
pub use decide::{ColourFeatures, Curvature, Decision, DepthFeatures, Features, FreeFitResidual};
pub(super) use flat_disc::{FlatDisc, find_discs};
pub use parameters::*;
pub use propose::{OddsMap, Proposal};
pub use pyramid::Window;
pub use ray_colours::RAYS;
pub use refine::{RayEnd, RefinedCircle, Surroundings};
pub use trace::{CandidateTrace, DetectionTrace, SearchTrace};
pub use view::Disc;

/// Searches a window of `frame` for the ball of `camera`. A window of less than four columns or
/// rows is not searched.
pub(super) fn search_window(
    frame: &RgbdFrame,
    window: Window,
    camera: &Camera,
    parameters: &ShapeParameters,
) -> SearchTrace {
    let coarser = coarser_levels(frame, window, camera, parameters);
    let Some(pyramid) = pyramid::Pyramid::new(frame.colour(), window, coarser) else {
        return SearchTrace::new(window);
    };
    let colour = ball_colour::BallColour::new(camera.ball_hue);
    let levels = pyramid.levels(frame.colour());
    let view = view::FrameView::new(frame, levels, colour, camera.ball_diameter / 2.0, parameters);
    search::search(&view, window)
}

/// Returns how many times the window must be halved once it has a quarter of the size, until the
/// proposer reaches the largest ball that can be in it.
fn coarser_levels(
    frame: &RgbdFrame,
    window: Window,
    camera: &Camera,
    parameters: &ShapeParameters,
) -> usize {
    let SearchParameters { min_distance, radius_margin, .. } = parameters.search;
    let nearest = frame.intrinsics().radius_at(camera.ball_diameter / 2.0, min_distance);
    let half_side = window.width.max(window.height) as f64 / 2.0;
    let largest = ((1.0 + radius_margin) * nearest).min(half_side);
    (largest / parameters.propose.max_radius).log2().ceil().max(0.0) as usize
}
