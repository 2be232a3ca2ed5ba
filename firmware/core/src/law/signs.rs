//! Σ: the sign pattern of the Jacobian.

use plumb_protocol::config;

/// Σ, pattern (12) of the paper, as i32: row by row (x, y, z), column by column (cable A, B, C).
pub(super) const SIGNS: [[i32; 3]; 3] = {
    let (mut signs, mut at) = ([[0; 3]; 3], 0);
    while at < 9 {
        signs[at / 3][at % 3] = config::SIGNS[at / 3][at % 3] as i32;
        at += 1;
    }
    signs
};
