//! Proofs about Plumb's control laws, for a family of rigs or for a family of Jacobians.
//!
//! - Bounds α and β of |∂p/∂u|: over a [family of rigs](RigFamily) and along a straight
//!   [path](BallPath) of the ball in one rig.
//! - Theorem 1 of the paper: whether an [interval matrix](IntervalMatrix) or a
//!   [polytope of matrices](Polytope) contains a singular matrix, and the minimum of |v|.
//! - Law `sign`: its [Routh-Hurwitz conditions](routh_hurwitz), and
//!   [the rigs on which |e| decreases](sign_descent), and [how fast](sign_decay).
//!
//! "Proved" means: by interval arithmetic with outward rounding, or by exact integer arithmetic.
//! The QP solver only proposes vectors; [`Polytope::robustness`] verifies them with intervals.
//!
//! The crate takes plain numbers and does no I/O; `plumb-lab verify` reads the files and prints the
//! results. Only the tests depend on the board's law and on the emulated rig: both are references.
//!
//! # Notation
//!
//! J = ∂p/∂u, in metres of ball per metre of cable: rows x, y, z, columns A, B, C. e is the
//! position error. D = y_A - y_B, W = x_A - x_C, t = (y_C - y_B)/D describe the triangle of the
//! motors, λ are the ball's barycentric coordinates in it, and h is the ball's depth below the
//! motors. Equation numbers are the paper's.
//!
//! ```
//! use plumb_verify::IntervalMatrix;
//!
//! // The signs of the paper's rig with 0.005 <= |J_ik| <= 0.5.
//! let family = IntervalMatrix::with_signs(0.005, 0.5);
//! assert!(family.is_nonsingular());
//! // With u' = -γ v, |e| <= |e(0)| exp(-γ v_min² t) for every J in the family.
//! assert!(family.min_v().lo > 0.0);
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod branch_and_bound;
mod entry_bounds;
mod interval;
mod interval_matrix;
mod path;
mod polynomial;
mod polytope;
mod qp;
mod rig_family;
mod sign_descent;

pub use entry_bounds::{EntryBounds, bounds_along_path, bounds_over_rigs, closed_form_bounds};
pub use interval::Interval;
pub use interval_matrix::IntervalMatrix;
pub use path::BallPath;
pub use polynomial::{RouthHurwitz, routh_hurwitz};
pub use polytope::{Nonsingularity, Polytope, PolytopeError, Robustness};
pub use qp::{MinimumNorm, QpError};
pub use rig_family::{RigFamily, RigFamilyError};
pub use sign_descent::{Descent, sign_decay, sign_descent};
