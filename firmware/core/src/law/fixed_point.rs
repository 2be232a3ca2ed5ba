//! Products and sizes in fixed point, for code that counts its bits.

/// Multiplies without an overflow check, which would take the chip longer than the product. The
/// caller counts the bits.
pub(super) fn times(a: i64, b: i64) -> i64 {
    a.wrapping_mul(b)
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
