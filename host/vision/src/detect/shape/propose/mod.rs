//! Stage 1, propose: places in the image where the ball may be.
//!
//! Two sources: clusters of coloured pixels whose depth ends where a ball would end, with a sphere
//! fitted to them ([`clusters`], [`sphere_fit`]), and blobs of the ball's colour ([`blobs`],
//! [`seeds`]). Both read the downsampled likeness map.

mod blobs;
mod clusters;
mod seeds;
mod sphere_fit;

pub use blobs::Proposal;
pub(super) use clusters::find_spheres;
pub(super) use seeds::{Seed, SeedSelector};
pub(super) use sphere_fit::sphere_at;
