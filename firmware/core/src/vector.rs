//! Arrays with an entry for each motor or axis, and vectors in f32.

use core::array;

use plumb_protocol::dimension::{PerAxis, PerMotor};

/// Returns the array of `value` of each motor.
#[inline(always)]
pub(crate) fn per_motor<T>(value: impl FnMut(usize) -> T) -> PerMotor<T> {
    array::from_fn(value)
}

/// Returns the array of `value` of each axis.
#[inline(always)]
pub(crate) fn per_axis<T>(value: impl FnMut(usize) -> T) -> PerAxis<T> {
    array::from_fn(value)
}

/// A vector with an entry for each axis, or for each motor: they are as many.
pub(crate) type Vector = PerAxis<f32>;

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
    per_axis(|i| a[i] + b[i] * factor)
}

/// Returns v, shortened to `longest` where it is longer.
#[inline(never)]
pub(crate) fn shortened(v: Vector, longest: f32) -> Vector {
    let length = length(v);
    if length > longest { scaled(v, longest / length) } else { v }
}
