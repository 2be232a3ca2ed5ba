//! `plumb bounds`: what can be said of the laws for every rig of a kind, or for every matrix of a family, by machine.
//!
//! What is called proved here is proved by interval arithmetic with outward rounding or by exact integers. The QP solver
//! only proposes: what it says is checked ([`Polytope::robustness`]).

mod descent;
mod directions;
mod family;
mod hurwitz;
mod interval;
mod jacobian;
mod polynomial;
mod polytope;
mod rigs;
mod search;

pub use descent::{Descent, sign_descent};
pub use family::Family;
pub use hurwitz::{RouthHurwitz, routh_hurwitz};
pub use interval::Interval;
pub use jacobian::{Magnitudes, over_rigs, over_way, rough};
pub use polytope::{MinimumNorm, Polytope, PolytopeError, Robustness, Verdict};
pub use rigs::{Rigs, RigsError, Way};
