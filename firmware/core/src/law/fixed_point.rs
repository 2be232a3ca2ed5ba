//! Products and sizes in fixed point, for code that counts its bits.

/// Multiplies without an overflow check, which would take the chip longer than the product. The
/// caller counts the bits.
pub(super) fn times(a: i64, b: i64) -> i64 {
    a.wrapping_mul(b)
}

/// Returns the ball's movement in one axis, µm, while the motors turn by `turned` steps. It has as
/// many fraction bits as `turned`. `row` is the row of J for the axis, Q6 µm/step. Before the
/// shift the sum has two bits more than a product.
pub(super) fn movement(row: [i32; 3], turned: [i64; 3]) -> i64 {
    (0..3).map(|k| times(row[k].into(), turned[k])).sum::<i64>() >> 6
}

/// Returns |e|² in µm² for `e` in µm.
pub(super) fn squared_length(e: [i32; 3]) -> i64 {
    e.iter().map(|e| times((*e).into(), (*e).into())).sum()
}

/// Returns by how many bits the largest of `values` is longer than `bits`; negative where it is
/// shorter.
pub(super) fn excess_bits(values: impl Iterator<Item = i32>, bits: u32) -> i32 {
    let longest = values.map(|v| 32 - v.unsigned_abs().leading_zeros()).max().unwrap_or(0);
    longest as i32 - bits as i32
}
