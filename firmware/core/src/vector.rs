//! Vectors of three in f32.

/// A vector of three numbers.
pub(crate) type Vector = [f32; 3];

/// Returns the scalar product.
pub(crate) fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the Euclidean length.
pub(crate) fn length(v: Vector) -> f32 {
    libm::sqrtf(dot(v, v))
}

/// Returns v times `factor`.
pub(crate) fn scaled(v: Vector, factor: f32) -> Vector {
    v.map(|v| v * factor)
}

/// Returns a + b times `factor`. Called often, so that it is not repeated in the chip's RAM.
#[inline(never)]
pub(crate) fn plus(a: Vector, b: Vector, factor: f32) -> Vector {
    [0, 1, 2].map(|i| a[i] + b[i] * factor)
}

/// Returns v, shortened to `longest` where it is longer.
#[inline(never)]
pub(crate) fn shortened(v: Vector, longest: f32) -> Vector {
    let length = length(v);
    if length > longest { scaled(v, longest / length) } else { v }
}
