//! Stage 1, propose: places in the image where the ball may be.
//!
//! Two sources: clusters of coloured pixels whose depth ends where a ball would end, with a sphere
//! fitted to them ([`cell_map`], [`clusters`], [`sphere_fit`]), and the proposer,
//! which reads the picture at a quarter of the size ([`input`], [`proposals`]).

mod cell_map;
mod clusters;
mod input;
mod proposals;
mod sphere_fit;

pub(super) use clusters::find_spheres;
pub(super) use proposals::propose;
pub use proposals::{OddsMap, Proposal};
pub(super) use sphere_fit::sphere_at;
