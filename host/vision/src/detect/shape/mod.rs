//! The detector `ball`: colour proposes, shape and size against depth decide.
//!
//! 1. Propose: clusters of coloured pixels with a sphere in depth, and blobs of the ball's colour
//!    of every size that the ball can have, on the image at a quarter of the size. Where depth is
//!    known, a ball has one size only, and blobs of another size are dropped.
//! 2. Refine: the circle of each seed is fitted to its edges, to a fraction of a pixel.
//! 3. Decide: the features of each circle give the probability that it is the ball. The most
//!    probable circle is the ball if its score is high enough; otherwise there is no ball.
//! 4. Observe: the ball's position follows from the depth on its disc
//!    ([`localise`](crate::localise)).
//!
//! The numbers are in [`ShapeParameters`]; what each stage found in a frame is in a
//! [`DetectionTrace`].

mod ball_colour;
mod decide;
mod detector;
mod disc_depth;
mod downsampled;
mod parameters;
mod propose;
mod radial_scan;
mod refine;
mod robust_fit;
mod search;
mod trace;
mod view;

pub use decide::{
    ColourFeatures, Curvature, Decision, DepthFeatures, Features, FreeFitResidual, SphereMatch,
};
pub use detector::ShapeDetector;
pub use downsampled::{LikenessMap, Window};
pub use parameters::*;
pub use propose::Proposal;
pub use radial_scan::RAYS;
pub use refine::{RayEnd, RefinedCircle, Surroundings};
pub use trace::{CandidateTrace, DetectionTrace, SearchTrace};
pub use view::Disc;
