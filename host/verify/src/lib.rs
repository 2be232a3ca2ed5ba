//! Proofs about Plumb's control laws, for every rig of a kind or for every Jacobian of a family.
//!
//! - Bounds α and β of |∂p/∂u| over [kinds of rigs](Rigs) and along the [way](Way) of one rig.
//! - Theorem 1: no matrix of a [`Family`] of intervals or of a [`Polytope`] is singular, and the
//!   least |v|.
//! - The [Routh-Hurwitz conditions](routh_hurwitz) of law `sign`, and
//!   [where it lets |e| fall](sign_descent).
//!
//! A result is called proved where it rests on interval arithmetic with outward rounding or on
//! exact integers. The QP solver only proposes vectors; [`Polytope::robustness`] checks them.
//!
//! The crate takes plain numbers. It knows no file, no camera, no board and no command:
//! `plumb verify` reads the files and prints the results. Only the crate's tests use the board's
//! law and the emulated rig, as references.
//!
//! ```
//! use plumb_verify::Family;
//!
//! // The signs of the paper's rig with 0.005 <= |J_ik| <= 0.5.
//! let family = Family::of_signs(0.005, 0.5);
//! assert!(family.nonsingular());
//! // With u' = -γ v, |e| falls at least as exp(-γ lo² t), whichever member is the true Jacobian.
//! assert!(family.least_v().lo > 0.0);
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

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
