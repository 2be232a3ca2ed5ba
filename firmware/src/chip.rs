//! What differs between the chips: one module for each, with the same names in it.

#[cfg(all(feature = "rp2040", feature = "rp2350"))]
compile_error!("choose one chip: the feature `rp2350` needs --no-default-features");

#[cfg(not(feature = "rp2350"))]
mod rp2040;
#[cfg(feature = "rp2350")]
mod rp2350;

#[cfg(not(feature = "rp2350"))]
pub(crate) use rp2040::*;
#[cfg(feature = "rp2350")]
pub(crate) use rp2350::*;
